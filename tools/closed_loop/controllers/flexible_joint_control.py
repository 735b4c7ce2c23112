# SPDX-License-Identifier: BSD-3-Clause
"""The controllers of the BioRob, eq. (61) to (65), and the one that the paper leaves to the future.

    tau = K_q (q_d - q) + K_dq (v_d - v) + K_th (th_d - th) + K_dth (dth_d - dth) + g(q_d) + friction  [joint side]
    u   = T^T tau / k_pwm           T: joint angles per motor angle; th = T q_motor

Motor angles on the plan hold the springs against the weight, eq. (16). `inverse_dynamics` takes them from eq. (15) and
the torque from eq. (17), with the mass matrix and Coriolis torques of the model.

Source: D. Ho, V. Kisner, "Trajectory Tracking Controller for a 4-DoF Flexible Joint Robot Arm", sec. 3 and 5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.tools.closed_loop.controllers.friction_automaton import FrictionAutomaton
from jointscope.tools.closed_loop.planning.plan import Plan
from jointscope.tools.closed_loop.planning.reference import model_reference
from jointscope.tools.simulator.loop.controller import drive_gains, full_command

Array = NDArray[np.float64]

FRICTIONLESS = 1e-9  # [N m] of a model whose friction the automaton compensates


@dataclass(frozen=True)
class Recipe:
    """What a controller is made of: gains of links and motors, and which torques it knows beforehand.

    Attributes:
        link, link_rate: K_q [N m/rad], K_dq [N m s/rad].
        motor: K_th [N m/rad].
        gravity: g(q_d) is added.
        friction: the automaton is added.
        dynamics: eq. (15) and (17) replace eq. (16) and (19).
    """

    link: tuple[float, ...] = ()
    link_rate: tuple[float, ...] = ()
    motor: tuple[float, ...] = ()
    gravity: bool = True
    friction: bool = False
    dynamics: bool = False


STIFF_LINK, LINK_RATE = (20.0, 20.0, 15.0, 10.0), (0.2, 0.2, 0.1, 0.1)  # sec. 5.1
SOFT_LINK, MOTOR = (1.0, 2.0, 6.5, 9.0), (45.0, 80.0, 80.0, 40.0)  # sec. 5.3
RECIPES = {
    "pd_link": Recipe(STIFF_LINK, LINK_RATE, gravity=False),  # (61)
    "pd_link_gravity": Recipe(STIFF_LINK, LINK_RATE),  # (62)
    "pd_both": Recipe(SOFT_LINK, motor=MOTOR),  # (63)
    "pd_both_friction": Recipe(SOFT_LINK, motor=MOTOR, friction=True),  # (64)
    "pd_motor_friction": Recipe(motor=MOTOR, friction=True),  # (65)
    "inverse_dynamics": Recipe(SOFT_LINK, motor=MOTOR, friction=True, dynamics=True),  # (15), (17)
}
ROBOTS = ("biorob",)  # whose gains these are
NEAR, TURN = (0.001, 0.001, 0.001, 0.001), (0.1, 0.1, 0.1, 0.5)  # eps_e [rad], delta [rad/s] of sec. 5.4
REST = 0.05  # [rad/s] eps, which the paper does not print: below all deltas


class FlexibleJointControl:
    """One controller on one plan.

    Args:
        robot: the model.
        plan: what the links should do.
        recipe: of the controller.

    Attributes:
        gain: command per error of the state, shape (n_joints, d).

    Raises:
        SimulationError: gains for this robot are not known.
    """

    def __init__(self, robot: Robot, plan: Plan, recipe: Recipe):
        if robot.name not in ROBOTS:
            raise SimulationError(
                f"robot {robot.name!r}: gains of the flexible-joint controllers are known for {', '.join(ROBOTS)}; "
                "use --controllers p,state_feedback"
            )
        layout, T = robot.layout, joint_angles(robot, np.eye(robot.n)).T
        self._full, self._per_torque = full_command(robot), 1.0 / drive_gains(robot)
        self._motor_q, self._motor_v = layout.motor_q, layout.motor_v
        still = 0.0 * plan.q
        static = model_reference(_frictionless(robot), plan.times, plan.q, still, still)
        moving = model_reference(_frictionless(robot), plan.times, plan.q, plan.v, plan.a) if recipe.dynamics else None
        self._reference = static.x.copy() if moving is None else moving.x
        if moving is None:
            self._reference[:, layout.joint_v] = plan.v
            self._reference[:, layout.motor_v] = np.gradient(static.x[:, layout.motor_q], plan.times, axis=0)
        self._ahead = static.u * float(recipe.gravity) if moving is None else moving.u
        self.gain = np.zeros((robot.n, layout.size))
        for columns, gains, seen in (
            (layout.joint_q, recipe.link, np.eye(robot.n)),
            (layout.joint_v, recipe.link_rate, np.eye(robot.n)),
            (layout.motor_q, recipe.motor, T),
        ):
            if gains:
                self.gain[:, columns] += self._per_torque[:, None] * (T.T @ np.diag(gains) @ seen)
        self._friction = _friction(robot, static.u / self._per_torque)
        turn, near = np.array(TURN), np.array(NEAR)
        self._automaton = FrictionAutomaton(np.full(robot.n, REST), near, turn) if recipe.friction else None

    def command(self, tick: int, x: Array) -> Array:
        """The command of a tick, shape (n_joints,)."""
        error = self._reference[tick] - x
        u = self._ahead[tick] + self.gain @ error
        if self._automaton is not None:
            torque = self._automaton.torque(error[self._motor_q], x[self._motor_v], self._friction[tick])
            u = u + self._per_torque * torque
        return np.clip(u, -self._full, self._full)


def _frictionless(robot: Robot) -> Robot:
    """The model without dry friction, which must not be compensated twice."""
    none = {f"{joint}.coulomb_torque": FRICTIONLESS for joint in robot.joints}
    loads = [f"{joint}.weight_dependent_friction.{p}" for joint in robot.joints for p in ("coefficient", "quadratic")]
    return robot.with_values({**none, **{name: 0.0 for name in loads if name in robot.parameters}})


def _friction(robot: Robot, load: Array) -> Array:
    """Friction of the motors under loads of shape (m, n_joints) [N m], eq. (12) and (14), shape (m, n_joints) [N m]."""
    friction = np.empty_like(load)
    for i, joint in enumerate(robot.joints):
        c1, c2 = (
            robot.parameters[name].value if name in robot.parameters else 0.0
            for name in (f"{joint}.weight_dependent_friction.{p}" for p in ("coefficient", "quadratic"))
        )
        size = np.abs(load[:, i])
        friction[:, i] = robot.drive_parameter(joint, "coulomb_torque").value + c1 * size + c2 * size**2
    return friction
