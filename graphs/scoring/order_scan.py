# SPDX-License-Identifier: BSD-3-Clause
"""At which orders (periods per turn of a joint) the missing torque of a motor repeats: a periodogram over the position.

The gradient of the cost by a torque at each tick is the residual of the motor's equation over its variance; its
Fourier transform over the motor's position has peaks where a ripple is missing. Only a search: the score test decides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.dynamics import DynamicsFactor
from jointscope.graphs.scoring.score_system import Segment

Array = NDArray[np.float64]

LARGEST_ORDER = 250.0
PEAKS = 3
OVERSAMPLING = 4  # points of the periodogram per independent order


@dataclass(frozen=True)
class OrderScan:
    """Result of the search.

    Attributes:
        orders: the strongest orders of every joint with a motor of its own.
        searched: number of independent orders behind each of them, by "cogging@joint".
    """

    orders: dict[str, tuple[float, ...]]
    searched: dict[str, int]


def scan_orders(segments: list[Segment]) -> OrderScan:
    """Searches every joint with a motor of its own."""
    robot = segments[0].problem.robot
    layout, found, searched = robot.layout, {}, {}
    known = (robot.constants["motor.gear"],) if "motor.gear" in robot.constants else ()
    for joint in layout.motors:
        row = layout.n_link + layout.motors.index(joint)
        column = layout.motor_q[layout.joints.index(joint)]
        q = np.concatenate([s.signals.x[:-1, column] for s in segments])
        pull = np.concatenate([_gradient(s, row) for s in segments])
        peaks = _peaks(q, pull)
        if peaks or known:
            found[joint] = tuple(sorted({*peaks, *known}))
            independent = LARGEST_ORDER * float(np.ptp(q)) / (2.0 * np.pi)
            searched[f"cogging@{joint}"] = max(int(independent / max(len(found[joint]), 1)), 1)
    return OrderScan(found, searched)


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
    # a histogram over the position turns the sum over samples into one over bins, and that into an FFT
    bins = int(np.ceil(reach * LARGEST_ORDER * 8.0 / (2.0 * np.pi))) + 1
    index = np.minimum(((q - q.min()) / reach * bins).astype(int), bins - 1)
    summed = np.bincount(index, weights=pull, minlength=bins)
    spread = np.sqrt(np.sum(pull**2))
    size = OVERSAMPLING * max(bins, int(np.ceil(2.0 * np.pi / reach * bins)))
    power = np.abs(np.fft.rfft(summed, size)) / max(float(spread), 1e-300)
    orders = 2.0 * np.pi * np.arange(len(power)) * bins / (size * reach)
    wanted = (orders >= 1.0) & (orders <= LARGEST_ORDER)
    orders, power = orders[wanted], power[wanted]
    if not len(power):
        return []
    inner = np.r_[True, power[1:] >= power[:-1]] & np.r_[power[:-1] >= power[1:], True]
    best = np.flatnonzero(inner)
    return [float(orders[i]) for i in best[np.argsort(-power[best])][:PEAKS]]
