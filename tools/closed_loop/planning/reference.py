# SPDX-License-Identifier: BSD-3-Clause
"""The states and commands with which the model's links would move exactly as planned.

    torque on the links   F = M (a_planned - a_free)       a_free: accelerations with relaxed springs
    springs               K s + D ds/dt = F                s = q_motor - q_link, likewise the hinges of soft bearings
                                                     (behind a transmission T: A q_link, and T^T F)
    command               u = b (d2q_motor/dt2 - a_motor(x, u = 0)) / (k_pwm U)

All torques come from the robot file's model with all its effects; those of commands (delays, dead bands) are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.dynamics.transmission import joint_angles, motor_angles
from jointscope.robots.model.robot import Robot
from jointscope.robots.model.structured_tree import bearing_names

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reference:
    """What the model does on the planned motion.

    Attributes:
        x: states in the layout of the model, shape (m, d).
        u: commands, each the mean over its tick, shape (m, n_joints), SI unit of the command.
    """

    x: Array
    u: Array


def parameter_values(model: ElasticJoints, robot: Robot) -> Array:
    """The free parameters as the robot file has them, shape (p,)."""
    return np.array([robot.parameters[name].value for name in model.names])


def model_reference(robot: Robot, times: Array, q: Array, v: Array, a: Array) -> Reference:
    """States and commands of a motion that begins at rest.

    Args:
        robot: the model.
        times: equal steps, shape (m,) [s].
        q: angles of the links, shape (m, n_joints) [rad].
        v: their velocities, shape (m, n_joints) [rad/s].
        a: their accelerations, shape (m, n_joints) [rad/s^2].
    """
    model, layout, step = ElasticJoints(robot), robot.layout, float(times[1] - times[0])
    parameters = parameter_values(model, robot)
    values = model.named(parameters)
    x = np.zeros((len(q), layout.size))
    x[:, layout.motor_q], x[:, layout.motor_v] = motor_angles(robot, q), motor_angles(robot, v)
    x[:, layout.joint_q], x[:, layout.joint_v] = q, v
    no_command = np.zeros((len(q), len(layout.joints)))
    free = model.with_derivatives(x, no_command, parameters)
    wanted = np.zeros((len(q), layout.n_link))
    wanted[:, layout.joint_link] = a
    missing = (wanted - free.value[:, : layout.n_link])[..., None]
    torque: Array = np.linalg.solve(free.rigid.by_torque, missing)[..., 0].astype(np.float64)
    springs = model.springs(x, values)
    loads = torque[:, layout.joint_link] @ joint_angles(robot, np.eye(robot.n)).T  # T^T F, by virtual work
    for i in layout.elastic_joints:
        stretch = _yielding(loads[:, i], springs.stiffness[i], springs.damping[i], step)
        x[:, layout.motor_q[i]] += stretch
        x[:, layout.motor_v[i]] += np.gradient(stretch, step)
    for link, stiffness, damping in _bearings(robot):
        x[:, link] = -_yielding(torque[:, link], stiffness, damping, step)
        x[:, layout.n_link + link] = np.gradient(x[:, link], step)
    u = _commands(model, x, parameters, torque, step)
    return Reference(x, 0.5 * (u + np.vstack([u[1:], u[-1:]])))


def _commands(model: ElasticJoints, x: Array, parameters: Array, torque: Array, step: float) -> Array:
    """Commands at the ticks, shape (m, n_joints)."""
    layout, gain = model.layout, model.drive_gain(parameters)
    inertia = model.motor_inertia(model.named(parameters))
    free = model.accelerations(x, np.zeros((len(x), len(gain))), parameters)
    u = np.empty((len(x), len(gain)))
    for i, row in enumerate(layout.motor_row.tolist()):
        if i in layout.elastic_joints:
            u[:, i] = inertia[i] * (np.gradient(x[:, layout.motor_v[i]], step) - free[:, row]) / gain[i]
        else:
            u[:, i] = torque[:, row] / gain[i]  # the motor turns with the link
    return u


def _bearings(robot: Robot) -> list[tuple[int, float, float]]:
    """Link coordinate, stiffness and damping of every hinge of a soft bearing."""
    found = []
    for joint in robot.joints:
        for axis, name in zip("xy", bearing_names(joint), strict=True):
            if name in robot.layout.links:
                effect = f"{joint}.bearing_flexibility"
                compliance, damping = (robot.parameter(f"{effect}.{p}_{axis}").value for p in ("compliance", "damping"))
                found.append((robot.layout.links.index(name), 1.0 / compliance, damping))
    return found


def _yielding(load: Array, stiffness: float, damping: float, step: float) -> Array:
    """Solution s of K s + D ds/dt = load from its rest, the load linear in each step, shape (m,)."""
    lag = damping / stiffness / step  # in steps
    decay = float(np.exp(-1.0 / lag)) if lag > 0 else 0.0
    mean = (1.0 - decay) * lag
    start = load[0] / stiffness
    driven = lfilter([1.0 - mean, mean - decay], [1.0, -decay], load / stiffness - start)
    return np.asarray(driven) + start
