# SPDX-License-Identifier: BSD-3-Clause
"""Runge-Kutta of order 4, and how many steps of it the friction of a robot asks for."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.robot import Robot

Array = NDArray[np.float64]

STABLE = 1.0  # largest step times rate; Runge-Kutta 4 is stable up to 2.8


def runge_kutta(rate: Callable[[Array], Array], x: Array, h: Array | float) -> Array:
    """States one step h [s] later, for dx/dt = rate(x)."""
    k1 = rate(x)
    k2 = rate(x + 0.5 * h * k1)
    k3 = rate(x + 0.5 * h * k2)
    k4 = rate(x + h * k3)
    return x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def stable_substeps(robot: Robot, h: float) -> int:
    """Number of steps into which h [s] must be cut: friction that changes its sign is the stiffest part."""
    friction = [robot.parameter(f"{j}.coulomb_torque").value for j in robot.joints]
    inertia = [robot.drive_parameter(j, "inertia").value for j in robot.joints]
    rate = robot.choices.friction_sharpness * float(np.max(np.array(friction) / np.array(inertia)))
    return max(int(np.ceil(h * rate / STABLE)), 1)
