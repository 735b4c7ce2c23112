# SPDX-License-Identifier: BSD-3-Clause
"""Torques of known loads are work per turn of a joint, and their derivatives those of differences."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.robots.bodies.known_loads import known_loads
from jointscope.robots.bodies.rigid_tree import RigidTree

# an arm that turns, slides and turns about slanted axes, with a branch that carries nothing
URDF = """<robot name="arm"><link name="base"/>
<joint name="a" type="revolute"><parent link="base"/><child link="one"/><axis xyz="0 1 0"/>
 <limit effort="9" velocity="9" lower="-3" upper="3"/></joint>
<link name="one"><inertial><mass value="1"/>
 <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="b" type="prismatic"><parent link="one"/><child link="two"/><origin xyz="0.1 0 0.4" rpy="0.3 0 0.2"/>
 <axis xyz="1 0 0"/><limit effort="9" velocity="9" lower="-3" upper="3"/></joint>
<link name="two"><inertial><mass value="1"/>
 <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="c" type="revolute"><parent link="two"/><child link="three"/><origin xyz="0 0.2 0.1"/>
 <axis xyz="0 0.6 0.8"/>
 <limit effort="9" velocity="9" lower="-3" upper="3"/></joint>
<link name="three"><inertial><mass value="1"/>
 <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="tip_joint" type="fixed"><parent link="three"/><child link="tip"/><origin xyz="0.3 0.1 0.2"/></joint>
<link name="tip"/></robot>"""


@pytest.fixture
def tree(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(URDF, encoding="utf-8")
    return RigidTree(path, ("a", "b", "c"), np.array([0.0, 0.0, -9.81]))


def test_derivatives_are_those_of_differences_for_joints_that_turn_and_slide(tree):
    rng, h = np.random.default_rng(1), 1e-6
    q, forces = rng.normal(size=(4, 3)), rng.normal(size=(4, 3))
    links = ("tip", "two", "", "one")
    found = known_loads(tree, links, forces, q)
    assert np.all(found.torque[2] == 0.0) and np.all(found.by_q[2] == 0.0)
    for k in range(3):
        step = h * np.eye(3)[k]
        up, down = (known_loads(tree, links, forces, q + side * step).torque for side in (1.0, -1.0))
        np.testing.assert_allclose(found.by_q[:, :, k], (up - down) / (2.0 * h), atol=1e-8)


def test_a_force_along_a_slide_acts_on_it_in_full(tree):
    q = np.zeros((1, 3))
    axis = np.array([np.cos(0.2), np.sin(0.2), 0.0])  # of joint b: x turned by 0.2 rad about z
    assert known_loads(tree, ("tip",), 3.0 * axis[None], q).torque[0, 1] == pytest.approx(3.0)
