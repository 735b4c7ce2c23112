# SPDX-License-Identifier: BSD-3-Clause
"""GTSAM's view of a factor: one `gtsam.CustomFactor` per sample, on the same residual code as the batch solver.

Keys: X(k) the state at tick k, D(0) the dynamics, R(i) the rotation (a Rot3) of gyro i, B(i) the bias of sensor i:
gyros, then accelerometers. States and biases of a second recording follow at a distance.
"""

from __future__ import annotations

from collections.abc import Callable

import gtsam
import numpy as np

from jointscope.factors.calibration import DYNAMICS, Calibration, bias_block, rotation_block
from jointscope.factors.factor import Factor

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
    for i, name in enumerate(calibration.biases):
        if block == bias_block(name):
            return gtsam.symbol("b", bag * GYROS_PER_BAG + i)
    raise KeyError(block)


def insert_calibration(values: gtsam.Values, calibration: Calibration, bag: int = 0) -> None:
    """Puts all blocks into GTSAM's values; for a further recording only its biases."""
    if bag == 0:
        values.insert(block_key(DYNAMICS, calibration), calibration.dynamics)
        for name, R in calibration.rotations.items():
            values.insert(block_key(rotation_block(name), calibration), gtsam.Rot3(R))
    for name, bias in calibration.biases.items():
        values.insert(block_key(bias_block(name), calibration, bag), bias)


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
    for name in biases:
        if bias_block(name) in wanted:
            biases[name] = values.atVector(block_key(bias_block(name), like, bag))
    return Calibration(like.names, like.positive, dynamics, biases, rotations)


def custom_factor(
    factor: Factor, sample: int, ticks: tuple[int, ...], calibration: Calibration, bag: int = 0
) -> gtsam.CustomFactor:
    """The factor of one sample.

    Args:
        factor: many samples.
        sample: index of the one.
        ticks: ticks of the states it touches.
        calibration: any calibration of the robot; gives the layout of the blocks.
        bag: number of the recording.
    """
    one = factor.select(slice(sample, sample + 1))
    keys = [state_key(tick, bag) for tick in ticks] + [block_key(block, calibration, bag) for block in factor.blocks]
    noise = gtsam.noiseModel.Diagonal.Sigmas(np.broadcast_to(one.sigmas, (1, len(one.rows)))[0].copy())
    return gtsam.CustomFactor(noise, keys, _callback(one, len(ticks), calibration, bag))


def stacked_factor(factor: Factor, calibration: Calibration, bag: int = 0) -> gtsam.CustomFactor:
    """All samples of a factor that touches no state as one; arguments as in `custom_factor`.

    It whitens itself: GTSAM takes a very small sigma, as that of a mounting that is held, for an exact constraint.
    """
    keys = [block_key(block, calibration, bag) for block in factor.blocks]
    sigmas = np.broadcast_to(factor.sigmas, (len(factor), len(factor.rows))).ravel().copy()

    def error(this: gtsam.CustomFactor, values: gtsam.Values, H: list | None) -> np.ndarray:
        here = extract_calibration(values, calibration, factor.blocks, bag)
        if H is None:
            return factor.residual((), here).ravel() / sigmas
        linear = factor.linearize((), here)
        for i, block in enumerate(factor.blocks):
            J = linear.by_block[block]
            H[i] = np.asfortranarray(J.reshape(len(sigmas), J.shape[2]) / sigmas[:, None])
        return linear.residual.ravel() / sigmas

    return gtsam.CustomFactor(gtsam.noiseModel.Unit.Create(len(sigmas)), keys, error)


def _callback(one: Factor, n_states: int, like: Calibration, bag: int) -> Callable:
    def error(this: gtsam.CustomFactor, values: gtsam.Values, H: list | None) -> np.ndarray:
        keys = this.keys()
        x = tuple(values.atVector(key)[None] for key in keys[:n_states])
        calibration = extract_calibration(values, like, one.blocks, bag)
        if H is None:
            return one.residual(x, calibration)[0]
        linear = one.linearize(x, calibration)
        jacobians = [J[0] for J in linear.by_state] + [linear.by_block[block][0] for block in one.blocks]
        for i, J in enumerate(jacobians):
            H[i] = np.asfortranarray(J)
        return linear.residual[0]

    return error
