# SPDX-License-Identifier: BSD-3-Clause
"""At which orders (periods per turn of a joint) the missing torque of a motor repeats: a periodogram over the position.

The gradient of the cost by a torque at each tick is the residual of the motor's equation over its variance; its
Fourier transform over the motor's position has peaks where a ripple is missing. Only a search: the score test decides.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.dynamics import DynamicsFactor
from jointscope.graphs.trial_system import Segment

Array = NDArray[np.float64]

LARGEST_ORDER = 250.0
PEAKS = 3


def scan_orders(segments: list[Segment]) -> dict[str, tuple[float, ...]]:
    """The strongest orders of every joint with a motor of its own, by joint."""
    robot = segments[0].problem.robot
    layout, found = robot.layout, {}
    for joint in layout.motors:
        row = layout.n_link + layout.motors.index(joint)
        column = layout.motor_q[layout.joints.index(joint)]
        q = np.concatenate([s.signals.x[:-1, column] for s in segments])
        pull = np.concatenate([_gradient(s, row) for s in segments])
        known = () if "motor.gear" not in robot.constants else (robot.constants["motor.gear"],)
        found[joint] = tuple(sorted({*_peaks(q, pull), *known}))
    return found


def _gradient(segment: Segment, row: int) -> Array:
    """Residual over variance of one equation at every step, shape (m,)."""
    parts = [
        linear.residual[:, row] / factor.sigmas[:, row] ** 2 * factor.steps.h
        for factor, _, linear in segment.linearized
        if isinstance(factor, DynamicsFactor)
    ]
    return np.concatenate(parts)


def _peaks(q: Array, pull: Array) -> list[float]:
    """Orders of the largest local maxima of the periodogram."""
    reach = float(np.ptp(q))
    if reach < 1e-3:
        return []
    # a histogram over the position turns the sum over samples into one over bins
    bins = int(np.ceil(reach * LARGEST_ORDER * 8.0 / (2.0 * np.pi))) + 1
    index = np.minimum(((q - q.min()) / reach * bins).astype(int), bins - 1)
    summed = np.bincount(index, weights=pull, minlength=bins)
    spread = np.sqrt(np.bincount(index, weights=pull**2, minlength=bins).sum())
    orders = np.arange(1.0, LARGEST_ORDER, 0.5 * np.pi / max(reach, 0.5 * np.pi))
    centres = (np.arange(bins) + 0.5) / bins * reach + q.min()
    power = np.abs(np.exp(1j * np.outer(orders, centres)) @ summed) / max(spread, 1e-300)
    inner = np.r_[True, power[1:] >= power[:-1]] & np.r_[power[:-1] >= power[1:], True]
    best = np.flatnonzero(inner)
    return [float(orders[i]) for i in best[np.argsort(-power[best])][:PEAKS]]
