# SPDX-License-Identifier: BSD-3-Clause
"""Any factor as one `gtsam.CustomFactor` per sample, on the same residual code as the condensed factors.

Keys: X(k) the state at tick k, D(0) the dynamics, R(i) the rotation (a Rot3) and B(i) the bias of gyro i. States and
biases of a second recording follow at a distance.
"""

from __future__ import annotations

import gtsam
import numpy as np

from jointscope.factors.calibration import DYNAMICS, Calibration, bias_block, rotation_block
from jointscope.factors.factor import Factor
from jointscope.robots.errors import SolveError

TICKS_PER_BAG = 10**9
GYROS_PER_BAG = 1000


def state_key(tick: int, bag: int = 0) -> int:
    """Key of the state at a tick of a recording."""
    return gtsam.symbol("x", bag * TICKS_PER_BAG + tick)


def block_key(block: str, calibration: Calibration, bag: int = 0) -> int:
    """Key of a block of the calibration."""
    if block == DYNAMICS:
        return gtsam.symbol("d", 0)
    for i, name in enumerate(calibration.rotations):
        if block == rotation_block(name):
            return gtsam.symbol("r", i)
        if block == bias_block(name):
            return gtsam.symbol("b", bag * GYROS_PER_BAG + i)
    raise KeyError(block)


def insert_calibration(
    values: gtsam.Values, calibration: Calibration, bag: int = 0, blocks: tuple[str, ...] | None = None
) -> None:
    """Puts blocks, all if None, into GTSAM's values; those that are there already stay."""
    wanted = calibration.blocks if blocks is None else blocks
    found: dict[str, np.ndarray | gtsam.Rot3] = {DYNAMICS: calibration.dynamics}
    found |= {rotation_block(name): gtsam.Rot3(R) for name, R in calibration.rotations.items()}
    found |= {bias_block(name): bias for name, bias in calibration.biases.items()}
    for block in wanted:
        key = block_key(block, calibration, bag)
        if not values.exists(key):
            values.insert(key, found[block])


def extract_calibration(
    values: gtsam.Values, like: Calibration, blocks: tuple[str, ...] | None = None, bag: int = 0
) -> Calibration:
    """Reads blocks from GTSAM's values; the others stay as in `like`."""
    wanted = like.blocks if blocks is None else blocks
    dynamics = values.atVector(block_key(DYNAMICS, like)) if DYNAMICS in wanted else like.dynamics
    rotations, biases = dict(like.rotations), dict(like.biases)
    for name in rotations:
        if rotation_block(name) in wanted:
            rotations[name] = values.atRot3(block_key(rotation_block(name), like)).matrix()
        if bias_block(name) in wanted:
            biases[name] = values.atVector(block_key(bias_block(name), like, bag))
    return Calibration(like.names, like.positive, dynamics, biases, rotations)


def single_factor(
    factor: Factor,
    sample: int,
    ticks: tuple[int, ...],
    calibration: Calibration,
    bag: int = 0,
    blocks: tuple[str, ...] | None = None,
) -> gtsam.CustomFactor:
    """The factor of one sample.

    Args:
        factor: many samples.
        sample: index of the one.
        ticks: ticks of the states it touches.
        calibration: any calibration of the robot; gives the layout of the blocks, and what is held.
        bag: number of the recording.
        blocks: those that may change; all if None.

    Raises:
        SolveError: a row whose sigma is not positive.
    """
    free = factor.blocks if blocks is None else tuple(block for block in factor.blocks if block in blocks)
    return _whitened(factor.select(slice(sample, sample + 1)), ticks, calibration, bag, free)


def stacked_factor(factor: Factor, calibration: Calibration, bag: int = 0) -> gtsam.CustomFactor:
    """All samples of a factor that touches no state as one; arguments as in `single_factor`."""
    return _whitened(factor, (), calibration, bag, factor.blocks)


def _whitened(
    factor: Factor, ticks: tuple[int, ...], like: Calibration, bag: int, free: tuple[str, ...]
) -> gtsam.CustomFactor:
    """Rows that are divided by their sigmas here: GTSAM takes a sigma below 1e-8 for an exact constraint.

    The position rows of a step of a millisecond have such sigmas, and so has a mounting that is held.
    """
    sigmas = np.broadcast_to(factor.sigmas, (len(factor), len(factor.rows))).ravel().copy()
    if not np.all(sigmas > 0.0):
        row = factor.rows[int(np.argmin(sigmas > 0.0)) % len(factor.rows)]
        raise SolveError(
            f"{factor.name}: sigma of {row} is {np.min(sigmas):g}; expected a positive number: a value that is known "
            "exactly is `fixed: true` in the robot file"
        )
    keys = [*(state_key(tick, bag) for tick in ticks), *(block_key(block, like, bag) for block in free)]
    states = keys[: len(ticks)]

    def error(this: gtsam.CustomFactor, values: gtsam.Values, H: list | None) -> np.ndarray:
        x = tuple(values.atVector(key)[None] for key in states)
        calibration = extract_calibration(values, like, free, bag)
        if H is None:
            return factor.residual(x, calibration).ravel() / sigmas
        linear = factor.linearize(x, calibration)
        jacobians = [*linear.by_state, *(linear.by_block[block] for block in free)]
        for i, J in enumerate(jacobians):
            H[i] = np.asfortranarray(J.reshape(len(sigmas), J.shape[2]) / sigmas[:, None])
        return linear.residual.ravel() / sigmas

    return gtsam.CustomFactor(gtsam.noiseModel.Unit.Create(len(sigmas)), keys, error)
