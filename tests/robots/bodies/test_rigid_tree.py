# SPDX-License-Identifier: BSD-3-Clause
"""Batched rigid-body terms against pinocchio, one sample at a time."""

import numpy as np
import pinocchio as pin
import pytest

from jointscope.robots.bodies.rigid_tree import RigidTree

SLANTED = """<robot name="slanted">
 <link name="base"/>
 <link name="a"><inertial><mass value="2"/><origin xyz="0.1 0.2 0.3"/>
  <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <link name="b"><inertial><mass value="1"/><origin xyz="0.1 0 0"/>
  <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <link name="c"><inertial><mass value="1"/>
  <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <link name="tip"/>
 <joint name="turn" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0.6 0 0.8"/>
  <origin xyz="1 0 0" rpy="0.1 0.2 0.3"/><limit effort="1" velocity="1" lower="-1" upper="1"/></joint>
 <joint name="slide" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
  <origin xyz="0 0 1" rpy="0.4 0 1"/><limit effort="1" velocity="1" lower="-1" upper="1"/></joint>
 <joint name="nod" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 -1 0"/>
  <origin xyz="0 1 0" rpy="0 0.5 0"/><limit effort="1" velocity="1" lower="-1" upper="1"/></joint>
 <joint name="flange" type="fixed"><parent link="c"/><child link="tip"/><origin xyz="0 0 1" rpy="1 2 3"/></joint>
</robot>"""


@pytest.fixture
def slanted(tmp_path):
    path = tmp_path / "slanted.urdf"
    path.write_text(SLANTED)
    return RigidTree(path, ("turn", "slide", "nod"), np.array([0.0, 0.0, -9.81]))


@pytest.mark.parametrize("body", ["a", "b", "c", "tip"])
def test_body_rates_equal_pinocchios_frame_velocities(slanted, body):
    rng = np.random.default_rng(0)
    q, v = rng.normal(size=(2, 20, 3))
    omega, by_q, by_v = slanted.body_rate(body, q, v)
    model, data, frame = slanted.model, slanted.model.createData(), slanted.frame_id(body)
    for k in range(len(q)):
        pin.computeForwardKinematicsDerivatives(model, data, q[k], v[k], np.zeros(3))
        expected_q, expected_v = pin.getFrameVelocityDerivatives(model, data, frame, pin.ReferenceFrame.LOCAL)
        expected = pin.getFrameVelocity(model, data, frame, pin.ReferenceFrame.LOCAL).angular
        np.testing.assert_allclose(omega[k], expected, atol=1e-13)
        np.testing.assert_allclose(by_q[k], expected_q[3:], atol=1e-13)
        np.testing.assert_allclose(by_v[k], expected_v[3:], atol=1e-13)


@pytest.mark.parametrize("coriolis", [True, False])
def test_accelerations_in_parallel_equal_those_with_derivatives(slanted, coriolis):
    tree = RigidTree(slanted.urdf, slanted.joints, slanted.gravity, coriolis)
    rng = np.random.default_rng(1)
    q, v, tau = rng.normal(size=(3, 7, 3))
    a, *_ = tree.acceleration_derivatives(q, v, tau)
    np.testing.assert_allclose(tree.acceleration(q, v, tau), a, atol=1e-10)
    np.testing.assert_allclose(tree.acceleration(q[:1], v[:1], tau[:1]), a[:1], atol=1e-10)
    M = tree.mass_matrix(q)
    bias = pin.rnea(tree.model, tree.own.data, q[0], v[0] if coriolis else 0 * v[0], np.zeros(3))
    np.testing.assert_allclose(M[0] @ a[0] + bias, tau[0], atol=1e-9)


@pytest.mark.parametrize("body", ["a", "b", "c", "tip"])
def test_compiled_rates_of_a_sensor_equal_those_of_its_body_turned(slanted, body):
    q, v = np.random.default_rng(3).normal(size=(2, 20, 3))
    R_sensor_body = pin.exp3(np.array([0.3, -1.2, 0.8]))
    found = slanted.sensed_rate(body, R_sensor_body, q, v, derivatives=True)
    omega, by_q, by_v = slanted.body_rate(body, q, v)
    for got, wanted in zip(found, (omega @ R_sensor_body.T, R_sensor_body @ by_q, R_sensor_body @ by_v), strict=True):
        np.testing.assert_allclose(got, wanted, atol=1e-13)
    np.testing.assert_array_equal(slanted.sensed_rate(body, R_sensor_body, q, v, derivatives=False)[0], found[0])
