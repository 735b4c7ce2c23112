# SPDX-License-Identifier: BSD-3-Clause
"""Whether a linear feedback keeps the model at rest at home, before anything is run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from jointscope.robots.model.robot import Robot
from jointscope.tools.closed_loop.planning.optimal_gains import linearised

Array = NDArray[np.float64]


def growth(robot: Robot, x: Array, gain: Array, step: float) -> tuple[float, float]:
    """How fast the fastest growing motion of the loop grows [1/s], negative if all decay, and its frequency [Hz].

    Commands are held from tick to tick. Dry friction counts as it brakes swings of half a radian a second, so that a
    loop which only sticks is not called stable.

    Args:
        robot: the model.
        x: state at which it should rest, shape (d,).
        gain: u = -gain (x - rest), shape (n_joints, d).
        step: between ticks [s].
    """
    columns = np.concatenate([robot.layout.positions, robot.layout.velocities])
    A, B = linearised(robot, x[None], columns)
    size, n = len(columns), robot.n
    held = expm(step * np.block([[A[0], B[0]], [np.zeros((n, size + n))]]))
    closed = held[:size, :size] - held[:size, size:] @ gain[:, columns]
    poles = np.linalg.eigvals(closed)
    pole = poles[np.argmax(np.abs(poles))]
    return float(np.log(np.abs(pole)) / step), float(abs(np.angle(pole)) / (2.0 * np.pi * step))
