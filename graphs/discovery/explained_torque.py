# SPDX-License-Identifier: BSD-3-Clause
"""Torques along a smoothed motion: those of springs and drives, and those that a candidate effect adds.

What an effect adds is the change of the accelerations by it times the inertias of the model without it; effects that
change inertias, commands or springs are all seen in the same way. States of the candidate that the model does not have
(a soft bearing's, a memory's) are zero, so the curves of such effects are not complete.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.robots.dynamics.command_path import CommandPath
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.files.effect_editing import remove_effect
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]


def explained_torque(robot: Robot, label: str, problem: BagProblem, x: Array) -> Array:
    """Torque that an effect adds to the right-hand sides, links before motors, shape (m, 2n) [N m].

    Args:
        robot: model with the effect.
        label: ID@OWNER.
        problem: recording with the model that lacks it.
        x: states of that model, shape (m, d).
    """
    robot = robot.in_posture(problem.recording.posture)
    base, n = remove_effect(robot, label), len(robot.joints)
    full = [model.layout.carried_over(x, problem.robot.layout) for model in (robot, base)]
    change = _accelerations(robot, problem, full[0]) - _accelerations(base, problem, full[1])
    link = np.zeros((len(x), base.layout.n_link))
    link[:, base.layout.joint_link] = change[:, :n]
    M = base.kinematic_tree.mass_matrix(full[1][:, base.layout.q_link])
    torque = (M @ link[:, :, None])[:, base.layout.joint_link, 0]
    b = np.array([base.drive_parameter(joint, "inertia").value for joint in base.joints])
    rigid = [joint not in base.layout.motors for joint in base.joints]
    torque[:, rigid] += (b * change[:, :n])[:, rigid]  # their rotors move with the links
    return np.hstack([torque, b * change[:, n:]])


def _accelerations(robot: Robot, problem: BagProblem, x: Array) -> Array:
    """Of the links and motors of all joints, shape (m, 2n) [rad/s^2]; zero for the motor of a rigid joint."""
    layout, timeline = robot.layout, problem.timeline
    values = robot.values
    model = ElasticJoints(robot)
    u = CommandPath(timeline.ticks, timeline.u, robot.effects, robot.joints, not robot.command_held).acting(values)[0]
    a = model.accelerations(x, _at_ticks(u), np.array([values[name] for name in model.names]))
    motor = np.zeros((len(x), len(robot.joints)))
    for i, joint in enumerate(robot.joints):
        if joint in layout.motors:
            motor[:, i] = a[:, layout.n_link + layout.motors.index(joint)]
    return np.hstack([a[:, layout.joint_link], motor])


def spring_and_drive(problem: BagProblem, x: Array) -> tuple[Array, Array]:
    """Torque of each spring, and of each motor without friction, shape (m, n) each [N m].

    Args:
        problem: recording and model.
        x: states of the model, shape (m, d).
    """
    robot, model = problem.robot, ElasticJoints(problem.robot)
    values = robot.values
    parameters = np.array([values[name] for name in model.names])
    u = problem.dynamics.steps.acting(values)[0]
    drive = _at_ticks(u) * model.drive_gain(parameters)
    if "k_mi" in robot.drive_laws:
        k_mi = np.array([robot.drive_parameter(joint, "k_mi").value for joint in robot.joints])
        drive = drive - k_mi * x[:, robot.layout.motor_v]
    return model.springs(x, values).torque, drive


def _at_ticks(u: Array) -> Array:
    """Commands of m - 1 steps at m ticks: each until the next, shape (m, n)."""
    return np.vstack([u, u[-1:]])
