# SPDX-License-Identifier: BSD-3-Clause
"""The recursion of specific forces gives what pinocchio's frame accelerations give, with the right derivatives."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from jointscope.robots.bodies.body_accelerations import specific_force
from jointscope.robots.bodies.rigid_tree import RigidTree

INERTIAL = """<inertial><mass value="2"/>
<inertia ixx="0.1" iyy="0.2" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial>"""
URDF = """<robot name="mixed">
<link name="base"/>
<link name="a">INERTIAL</link>
<link name="b">INERTIAL</link>
<link name="c">INERTIAL</link>
<link name="tip"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0.1 0.2 0.3" rpy="0.3 0.1 0.2"/>
  <axis xyz="0 0.6 0.8"/><limit lower="-3" upper="3" effort="9" velocity="9"/></joint>
<joint name="j2" type="prismatic"><parent link="a"/><child link="b"/><origin xyz="0.3 0 0.1" rpy="0 0.7 0"/>
  <axis xyz="1 0 0"/><limit lower="-3" upper="3" effort="9" velocity="9"/></joint>
<joint name="j3" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0 0.4 0" rpy="0.5 0 0"/>
  <axis xyz="-1 0 0"/><limit lower="-3" upper="3" effort="9" velocity="9"/></joint>
<joint name="fix" type="fixed"><parent link="c"/><child link="tip"/><origin xyz="0.1 0.2 0" rpy="0 0 1"/></joint>
</robot>"""
LEVER = np.array([0.05, -0.1, 0.2])


@pytest.fixture
def tree(tmp_path: Path) -> RigidTree:
    path = tmp_path / "mixed.urdf"
    path.write_text(URDF.replace("INERTIAL", INERTIAL))
    return RigidTree(path, ["j1", "j2", "j3"], np.array([0.5, 0.0, -9.81]))


@pytest.mark.parametrize("body", ["base", "a", "b", "c", "tip"])
def test_the_force_is_that_of_pinocchios_frame_acceleration(tree: RigidTree, body: str):
    q, v, a = np.random.default_rng(1).normal(size=(3, 4, 3))
    found = specific_force(tree, body, LEVER, q, v, a).value
    frame = tree.frame_id(body)
    for k in range(4):
        pin.forwardKinematics(tree.model, tree.own.data, q[k], v[k], a[k])
        pose = pin.updateFramePlacement(tree.model, tree.own.data, frame)
        rate = pin.getFrameVelocity(tree.model, tree.own.data, frame, pin.LOCAL).angular
        spatial = pin.getFrameClassicalAcceleration(tree.model, tree.own.data, frame, pin.LOCAL)
        here = spatial.linear + np.cross(spatial.angular, LEVER) + np.cross(rate, np.cross(rate, LEVER))
        np.testing.assert_allclose(found[k], here - pose.rotation.T @ tree.gravity, atol=1e-11)


@pytest.mark.parametrize("body", ["a", "b", "tip"])
def test_derivatives_are_those_of_differences(tree: RigidTree, body: str):
    arguments = [LEVER, *np.random.default_rng(2).normal(size=(3, 4, 3))]
    found = specific_force(tree, body, *arguments)
    analytic = found.by_lever, found.by_q, found.by_v, found.by_a
    for which, J in enumerate(analytic):
        for i in range(3):
            sides = []
            for step in (1e-6, -1e-6):
                moved = [np.array(argument) for argument in arguments]
                moved[which][..., i] += step
                sides.append(specific_force(tree, body, *moved).value)
            np.testing.assert_allclose(J[:, :, i], (sides[0] - sides[1]) / 2e-6, atol=1e-7)
