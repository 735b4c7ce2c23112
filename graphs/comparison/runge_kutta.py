# SPDX-License-Identifier: BSD-3-Clause
"""Runge-Kutta of order 4, and how many steps of it a robot asks for.

Friction is a steep function of the velocity near zero, tanh(k v), and flat beyond: there the robot is as stiff as
friction over the inertia that it really moves, elsewhere as its springs and dampers. So a step is cut finely only for
states whose velocities may come near zero within it; the others take few steps.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.state_rates import StateRates
from jointscope.robots.dynamics.transmission import motor_angles
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

STABLE = 1.0  # largest step times rate; Runge-Kutta 4 is stable up to 2.8
STEEP = 0.5  # the same where friction changes its sign; errors are then a thousandth of an encoder's noise
FLAT = 0.02  # the same for what friction may still contribute where steps are coarse
POSTURES = 16  # at which the inertia that moves is looked at
ANY_ANGLE = np.pi  # [rad] or [m] how far from zero postures may lie where the URDF gives no limits
FAST = 1.0  # [rad/s] a velocity at which friction is flat
REACH = 1.5  # of the way that the present acceleration leads within a step: as near may a velocity come to zero


def runge_kutta(rate: Callable[[Array], Array], x: Array, h: Array | float) -> Array:
    """States one step h [s] later, for dx/dt = rate(x)."""
    return runge_kutta_from(rate(x), rate, x, h)


def runge_kutta_from(k1: Array, rate: Callable[[Array], Array], x: Array, h: Array | float) -> Array:
    """The same where k1 = rate(x) is known already."""
    k2 = rate(x + 0.5 * h * k1)
    k3 = rate(x + 0.5 * h * k2)
    k4 = rate(x + h * k3)
    return x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


class StepCuts:
    """Into how many steps of Runge-Kutta a step of the recording is cut.

    Args:
        robot: the model with its present parameters.
        h: length of a step [s].
        rates: of that robot, where they are there already.

    Attributes:
        coarse: number of steps where all joints move.
        fine: number where a joint is near standing still.
    """

    def __init__(self, robot: Robot, h: float, rates: StateRates | None = None):
        flat, steep = _fastest_rates(robot, rates or StateRates(robot))
        self.coarse = _steps(h * flat / STABLE)
        wanted = _steps(h * steep / STEEP)
        # with two alone the change of sign would be crossed in a leap
        self.fine = max(wanted + (wanted > 1), self.coarse)
        layout = robot.layout
        self._columns = np.unique(np.r_[layout.joint_v, layout.motor_v]).astype(np.intp)
        # where the slope of tanh has fallen so far that coarse steps do
        fallen = max(h * steep / self.coarse / FLAT, 1.0)
        self._band = float(np.arccosh(np.sqrt(fallen))) / float(np.min(robot.friction_sharpness()))

    def fine_ones(self, x: Array, rate: Array, h: Array | float) -> NDArray[np.bool_]:
        """Whether states need fine steps, shape (...,), for states and their rates of shape (..., d)."""
        columns = self._columns
        reach = self._band + REACH * h * np.abs(rate[..., columns])
        return np.asarray(np.any(np.abs(x[..., columns]) < reach, axis=-1))


def _steps(wanted: float) -> int:
    return max(int(np.ceil(wanted)), 1)


def _fastest_rates(robot: Robot, rates: StateRates) -> tuple[float, float]:
    """Largest eigenvalue of the motion where friction is flat and where it is steepest [1/s]."""
    layout, rng = robot.layout, np.random.default_rng(0)
    limits = np.clip(robot.tree.limits, -ANY_ANGLE, ANY_ANGLE)
    torque, found = np.zeros(robot.n), []
    for _ in range(POSTURES):
        q = rng.uniform(limits[:, 0], limits[:, 1])
        v = FAST * rng.choice([-1.0, 1.0], robot.n)
        q_motor = motor_angles(robot, q)
        at = [layout.from_joints(np.hstack([q, w, q_motor, motor_angles(robot, w)])[None])[0] for w in (v, 0.0 * v)]
        found.append([_spectral_radius(rates.with_jacobian(x, torque)[1]) for x in at])
    flat, steep = np.max(found, axis=0)
    return float(flat), float(steep)


def _spectral_radius(A: Array) -> float:
    values = np.linalg.eigvals(A) if np.all(np.isfinite(A)) else np.zeros(1)
    return float(np.max(np.abs(values)))
