# SPDX-License-Identifier: BSD-3-Clause
"""The linear model of a robot around a posture in which springs carry its weight, for whoever designs a controller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.window.state_names import state_names
from jointscope.robots.dynamics.state_rates import StateRates
from jointscope.robots.errors import RobotError
from jointscope.robots.model.encoder_plays import EncoderPlays
from jointscope.robots.model.robot import SHARPNESS
from jointscope.tools.notebook.given import AnyRobot, robot_of

Array = NDArray[np.float64]

SLIDING, AT_ONCE = 1e-6, 1e9  # [rad/s] and [s/rad]: dry friction is constant at this speed, and all else as at rest
STEPS = 30  # of Newton's method towards the equilibrium
BALANCED = 1e-9  # [rad/s^2] that is left there


@dataclass(frozen=True)
class LinearModel:
    """d(x - state)/dt = A (x - state) + B (u - command).

    Attributes:
        A: shape (d, d).
        B: shape (d, n), by the command in its SI unit.
        state: the equilibrium: positions and velocities of links, the same of motors, memories but for lags of encoders
            with play, which move nothing, shape (d,).
        command: that holds it, without dry friction, shape (n,).
        names: of the state's components.
        rows: where these are in a state of the estimator, shape (d,).
    """

    A: Array
    B: Array
    state: Array
    command: Array
    names: tuple[str, ...]
    rows: NDArray[np.intp]

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Eigenvalues of A [1/s], slowest first."""
        found = np.linalg.eigvals(self.A).astype(complex)
        return found[np.argsort(np.abs(found))]

    def response(self, frequencies: Array) -> NDArray[np.complex128]:
        """State over command at some frequencies [Hz], shape (k, d, n)."""
        s = 2j * np.pi * np.atleast_1d(np.asarray(frequencies, dtype=float))
        unit, B = np.eye(len(self.A)), self.B.astype(np.complex128)
        return np.asarray(np.linalg.solve(s[:, None, None] * unit - self.A, B), dtype=np.complex128)


def linear_model(robot: AnyRobot, posture: Mapping[str, float] | None = None) -> LinearModel:
    """Linearises a robot where it stands.

    Dry friction is left out, as linear feedback cannot know it: a joint that slides has it as a constant torque, one
    that sticks does not answer at all (Ho, Kisner, "Trajectory Tracking Controller for a 4-DoF Flexible Joint Robot
    Arm", app. B.1). Viscous friction, springs at their load, weight and memories of effects are in; errors of encoders
    are not, for the estimator takes them off.

    Args:
        robot: with the values to use, as `calibrate` finds them, the name of a ready robot, or the path of a file.
        posture: positions of the joints by name [rad] or [m]; zero where none is given.

    Raises:
        RobotError: no equations of motion, no such joint, or a posture in which the springs cannot carry the weight.
    """
    robot = robot_of(robot)
    robot.need_link_dynamics()
    layout, given = robot.layout, dict(posture or {})
    for joint in given:
        if joint not in layout.links:
            raise RobotError(f"{robot.name}: no joint {joint!r}; expected some of {', '.join(layout.links)}")
    rates = StateRates(robot, {f"{joint}.{SHARPNESS}": AT_ONCE for joint in robot.joints})
    x = np.zeros(layout.size)
    x[layout.q_link] = [given.get(link, 0.0) for link in layout.links]
    x[layout.q_motor] = x[layout.joint_link[[layout.joints.index(motor) for motor in layout.motors]]]
    if robot.transmission is not None and layout.n_motor == robot.n:
        x[layout.q_motor] = np.linalg.solve(robot.transmission, x[layout.joint_link])
    moved = np.arange(layout.size)[layout.q_motor]
    torque, rows = np.zeros(robot.n), layout.velocities
    left = np.inf
    for _ in range(STEPS):
        rate, A, by_torque = _both_ways(rates, x, torque)
        left = float(np.max(np.abs(rate[rows]), initial=0.0))
        if left < BALANCED:
            break
        slope = np.hstack([A[np.ix_(rows, moved)], by_torque[rows]])
        step = np.linalg.lstsq(slope, -rate[rows], rcond=None)[0]
        x[moved] += step[: len(moved)]
        torque += step[len(moved) :]
    if not left < 1e3 * BALANCED:
        angles = ", ".join(f"{link} {value:.4g}" for link, value in zip(layout.links, x[layout.q_link], strict=True))
        raise RobotError(
            f"{robot.name}: no command holds {angles}: {left:.3g} rad/s^2 are left; expected a posture that springs "
            "and motors can carry"
        )
    gain = rates.command_torque(np.ones(robot.n))
    plays = EncoderPlays.of(robot)
    moving = np.arange(layout.size) if plays is None else np.delete(np.arange(layout.size), plays.lags)
    names, B = state_names(layout), (by_torque * gain)[moving]
    return LinearModel(A[np.ix_(moving, moving)], B, x[moving], torque / gain, tuple(names[i] for i in moving), moving)


def _both_ways(rates: StateRates, x: Array, torque: Array) -> tuple[Array, Array, Array]:
    """dx/dt with its derivatives, mean of joints that slide forth and back: what dry friction does cancels."""
    velocities = rates.layout.velocities
    found = []
    for way in (SLIDING, -SLIDING):
        sliding = x.copy()
        sliding[velocities] = way
        found.append(rates.with_jacobian(sliding, torque))
    rate, A, by_torque = (0.5 * (forth + back) for forth, back in zip(*found, strict=True))
    return rate, A, by_torque
