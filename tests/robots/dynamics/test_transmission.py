# SPDX-License-Identifier: BSD-3-Clause
"""Motors and joints that a matrix couples: torques by virtual work, derivatives, and nothing where there is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from robots_to_compare import READY, ROBOTS, coupled, states

from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.dynamics.transmission import Transmission, joint_angles, motor_angles
from jointscope.robots.files.effect_editing import add_effect

COUPLED = [name for name in ROBOTS if name.startswith("coupled")]


def values_of(robot, joints):
    return np.array([robot.parameters[name].value for name in joints.names])


def test_robots_without_coupling_have_no_transmission():
    assert Transmission.of(READY) is None
    q = np.ones((2, 3))
    assert joint_angles(READY, q) is q and motor_angles(READY, q) is q


def test_relaxed_springs_pull_at_nothing_and_a_stretched_one_does_virtual_work():
    robot = coupled(READY)
    T, joints, rng = robot.transmission, ElasticJoints(robot), np.random.default_rng(3)
    x = np.zeros((4, robot.layout.size))
    x[:, robot.layout.motor_q] = rng.normal(size=(4, 3))
    x[:, robot.layout.joint_q] = x[:, robot.layout.motor_q] @ T.T
    values = joints.named(values_of(robot, joints))
    np.testing.assert_allclose(joints.springs(x, values).torque, 0.0, atol=1e-12)
    np.testing.assert_allclose(motor_angles(robot, joint_angles(robot, x[:, :3])), x[:, :3], atol=1e-12)
    # torques are minus the slopes of the springs' energy, here by differences
    x[:, robot.layout.joint_q] += 0.02 * rng.normal(size=(4, 3))
    K = np.array([robot.parameters[f"{joint}.stiffness"].value for joint in robot.joints])

    def energy(q_link):
        return 0.5 * np.sum(K * (q_link @ np.linalg.inv(T).T - x[:, robot.layout.motor_q]) ** 2, axis=1)

    q, h = x[:, robot.layout.joint_q], 1e-5
    slopes = np.column_stack([(energy(q + h * e) - energy(q - h * e)) / (2 * h) for e in np.eye(3)])
    a = joints.accelerations(x, np.zeros((4, 3)), values_of(robot, joints))[:, :3]
    torque = np.einsum("kij,kj->ki", robot.tree.mass_matrix(q), a)
    np.testing.assert_allclose(torque, -slopes, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("name", COUPLED)
def test_derivatives_are_those_by_differences(name):
    robot = ROBOTS[name]
    joints, x = ElasticJoints(robot), states(robot, 5)
    x[:, robot.layout.motor_q] = motor_angles(robot, x[:, robot.layout.joint_q]) + 0.01
    u, p = np.random.default_rng(4).uniform(-1.0, 1.0, (5, 3)), values_of(robot, joints)
    found = joints.with_derivatives(x, u, p)
    for index, name in enumerate(joints.names):
        if "bearing" in name:
            continue  # of bodies: tested where they are, and lost in rounding here
        step = 1e-5 * max(abs(p[index]), 1e-2) * np.eye(len(p))[index]
        slope = (joints.accelerations(x, u, p + step) - joints.accelerations(x, u, p - step)) / (2 * step[index])
        scale = np.abs(slope).max() + 1.0
        np.testing.assert_allclose(found.by_parameter[:, :, index], slope, rtol=1e-4, atol=1e-6 * scale, err_msg=name)
    for column in range(x.shape[1]):
        step = 1e-7 * np.eye(x.shape[1])[column]
        slope = (joints.accelerations(x + step, u, p) - joints.accelerations(x - step, u, p)) / 2e-7
        np.testing.assert_allclose(
            found.by_state[:, :, column], slope, rtol=1e-4, atol=1e-4 * np.abs(slope).max() + 1e-3
        )


def test_an_element_as_parameter_is_the_same_as_in_the_matrix_and_as_an_effect():
    robot, u = coupled(READY), np.zeros((6, 3))
    x = states(robot, 6)
    plain = {name: p for name, p in robot.parameters.items() if ".from_" not in name}
    as_matrix = replace(robot, parameters=plain)
    a = [ElasticJoints(r).accelerations(x, u, values_of(r, ElasticJoints(r))) for r in (robot, as_matrix)]
    np.testing.assert_array_equal(a[0], a[1])


def test_the_effect_follows_from_a_potential_and_a_dissipation():
    """Torques are minus the gradients of K delta^2 / 2 by the positions and D rate^2 / 2 by the velocities."""
    robot = add_effect(READY, "kinematic_coupling@joint3", {"from_joint1": 0.1, "from_joint2": -0.3})
    x, u, c = states(READY, 5, seed=4), np.zeros((5, 3)), np.array([0.1, -0.3, 0.0])
    with_effect, without = ElasticJoints(robot), ElasticJoints(READY)
    change = with_effect.accelerations(x, u, values_of(robot, with_effect))
    change -= without.accelerations(x, u, values_of(READY, without))
    q_link, v_link, q_motor, v_motor = np.split(READY.layout.by_joint(x), 4, axis=1)
    K, D = (READY.parameters[f"joint3.{name}"].value for name in ("stiffness", "damping"))
    base = K * (q_link - q_motor)[:, 2] + D * (v_link - v_motor)[:, 2]
    tau = K * ((q_link - q_motor)[:, 2] - q_link @ c) + D * ((v_link - v_motor)[:, 2] - v_link @ c)
    link = np.einsum("kij,kj->ki", READY.tree.mass_matrix(q_link), change[:, :3])
    np.testing.assert_allclose(link, np.column_stack([0.1 * tau, -0.3 * tau, base - tau]), atol=1e-9)
    motor = READY.parameters["motor.inertia"].value * change[:, 3:]
    np.testing.assert_allclose(motor, np.column_stack([0 * tau, 0 * tau, tau - base]), atol=1e-9)


def test_the_effect_at_null_is_the_model_without_it():
    robot, x, u = add_effect(READY, "kinematic_coupling@joint2"), states(READY, 5), np.ones((5, 3))
    null = robot.with_values({name: 0.0 for name, p in robot.parameters.items() if p.effect})
    a, b = (ElasticJoints(r).accelerations(x, u, values_of(r, ElasticJoints(r))) for r in (null, READY))
    np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-12)
