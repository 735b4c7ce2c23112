# SPDX-License-Identifier: BSD-3-Clause
"""Any factor as one `gtsam.CustomFactor` per sample, on the same residual code as the condensed factors.

Keys: X(k) the state at tick k, D(0) the dynamics, R(i) the rotation (a Rot3) and B(i) the bias of gyro i; blocks of
other kinds of recordings say theirs. States and blocks that a second recording has for itself follow at a distance.
"""

from __future__ import annotations

import gtsam
import numpy as np

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Factor
from jointscope.robots.errors import SolveError

TICKS_PER_BAG = 10**9


def state_key(tick: int, bag: int = 0) -> int:
    """Key of the state at a tick of a recording."""
    return gtsam.symbol("x", bag * TICKS_PER_BAG + tick)


def block_key(block: str, calibration: Calibration, bag: int = 0) -> int:
    """Key of a block of the calibration."""
    return calibration.layout[block].key(bag)


def insert_calibration(
    values: gtsam.Values, calibration: Calibration, bag: int = 0, blocks: tuple[str, ...] | None = None
) -> None:
    """Puts blocks, all if None, into GTSAM's values; those that are there already, as shared ones are, stay."""
    for name, block in calibration.layout.items():
        if (blocks is None or name in blocks) and not values.exists(block.key(bag)):
            values.insert(block.key(bag), block.kind.to_gtsam(calibration[name]))


def extract_calibration(
    values: gtsam.Values, like: Calibration, blocks: tuple[str, ...] | None = None, bag: int = 0
) -> Calibration:
    """Reads blocks from GTSAM's values; the others stay as in `like`."""
    wanted = like.blocks if blocks is None else blocks
    layout = like.layout
    return like.with_points({name: layout[name].kind.from_gtsam(values, layout[name].key(bag)) for name in wanted})


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
