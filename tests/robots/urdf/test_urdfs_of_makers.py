# SPDX-License-Identifier: BSD-3-Clause
"""URDFs as they are shipped: without limits, with leftovers, doubtful inertias, names that are used twice."""

from __future__ import annotations

import re

import numpy as np
import pytest
from robots_to_compare import MIMICKING

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.errors import RobotError
from jointscope.robots.urdf.usable_joints import moving_joints

DOWN = np.array([0.0, 0.0, -9.81])
JOINTS = ("joint1", "joint2", "joint3")
LIMIT = '<limit lower="-1.5708" upper="1.5708" effort="200" velocity="12"/>'


@pytest.fixture
def changed(tmp_path):
    """Writes the URDF of the tests with some text replaced."""

    def write(*changes):
        text = MIMICKING.read_text()
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "arm.urdf"
        path.write_text(text)
        return path

    return write


def same(one, other):
    q = np.random.default_rng(0).normal(size=(4, one.n))
    np.testing.assert_allclose(one.mass_matrix(q), other.mass_matrix(q), rtol=1e-12)
    np.testing.assert_allclose(one.torque(q, q, q), other.torque(q, q, q), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(
    "changes",
    [
        [(LIMIT, "")],
        [(LIMIT, '<limit lower="-2" upper="2"/>')],
        [(LIMIT, '<limit lower="0.0" upper="0.0" effort="0" velocity="0"/>')],
        [('<link name="base"/>', '<xacro:include filename="x"/><link name="base"/>')],
        [('<robot name="mimicking_doggy">', '<robot name="mimicking_doggy"><material name="grey"/>')],
        [('<link name="base"/>', '<link name="base"><visual><geometry><mesh filename="package://a/b.stl"/></geometry>'
          "</visual></link>")],
        [("</robot>", '<transmission name="t"><joint name="joint1"/><actuator name="m"/></transmission>'
          '<ros2_control><joint name="joint2"><mimic joint="joint1"/></joint></ros2_control></robot>')],
        [("</robot>", '<gazebo reference="link1"><kp:x/></gazebo></robot>')],
    ],
)  # fmt: skip
def test_what_does_not_concern_the_bodies_changes_nothing(changed, changes):
    same(RigidTree(changed(*changes), JOINTS, DOWN), RigidTree(MIMICKING, JOINTS, DOWN))


def test_limits_that_are_missing_are_none(changed):
    tree = RigidTree(changed((LIMIT, "")), ("joint2", "ear"), DOWN)
    np.testing.assert_array_equal(tree.limits, [[-np.inf, np.inf], [-2.0, 2.0]])
    np.testing.assert_array_equal(tree.velocity_limits, [np.inf, 3.0])
    np.testing.assert_array_equal(tree.effort_limits, [0.0, 20.0])


@pytest.mark.parametrize("axis", ["1 0 0", "0 1 0", "0 0 1", "0 0 -1", "0.6 0 0.8", "0 3 4"])
def test_a_continuous_joint_moves_as_a_revolute_one(changed, axis):
    new = f'<axis xyz="{axis}"/>'
    turning = changed(('<axis xyz="0 0.6 0.8"/>', new))
    trees = [RigidTree(turning, JOINTS, DOWN)]
    trees.append(RigidTree(changed(('<axis xyz="0 0.6 0.8"/>', new), ('"continuous"', '"revolute"')), JOINTS, DOWN))
    same(*trees)
    # any number of turns is a position, and the same place after each
    one = RigidTree(
        changed(('<axis xyz="0 0.6 0.8"/>', new), ('<mimic joint="joint1" multiplier="0.05"/>', "")), ("joint1",), DOWN
    )
    still = np.zeros((1, 1))
    weights = [one.torque(np.array([[q]]), still, still) for q in (0.3, 0.3 + 40.0 * np.pi)]
    np.testing.assert_allclose(*weights, atol=1e-9)


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_joints_with_several_axes_stay_where_they_are_and_are_refused_as_joints(changed, kind):
    path = changed(('name="wave" type="revolute"', f'name="wave" type="{kind}"'))
    assert moving_joints(path) == ("joint1", "joint2", "joint3", "ear")
    same(RigidTree(path, JOINTS, DOWN), RigidTree(MIMICKING, JOINTS, DOWN))
    with pytest.raises(RobotError) as error:
        RigidTree(path, ("joint1", "wave"), DOWN)
    assert str(error.value) == (
        "arm.urdf: wave is a floating or planar joint, which has several axes; joints can be revolute, continuous or "
        "prismatic. Leave it out: it is then locked where the URDF places it"
    )


def test_links_may_have_the_names_of_joints(changed):
    names = [(f'"link{i}"', f'"joint{i}"') for i in (1, 2, 3)]
    tree = RigidTree(changed(*names), JOINTS, DOWN, locked={"ear": 0.4})
    same(tree, RigidTree(MIMICKING, JOINTS, DOWN, locked={"ear": 0.4}))
    assert tree.joints_below("joint2") == (0, 1)


def test_an_inertia_that_no_body_has_is_a_remark(changed):
    tree = RigidTree(changed(('ixx="0.30" iyy="0.35" izz="0.47"', 'ixx="0.10" iyy="0.15" izz="0.47"')), JOINTS, DOWN)
    (remark,) = tree.remarks
    assert remark.startswith("arm.urdf: link link1, moved by joint1, cannot exist: principal moments 0.09807")
    assert remark.endswith("mass 1 kg; the largest moment exceeds the sum of the others by 47 %")
    assert RigidTree(MIMICKING, JOINTS, DOWN).remarks == ()
    # behind a joint that is locked it is part of a larger body, which may well exist
    assert RigidTree(changed(('ixx="0.005" iyy="0.004"', 'ixx="0.0005" iyy="0.0004"')), JOINTS, DOWN).remarks == ()


def test_a_link_without_inertia_between_others_is_no_trouble_and_at_the_end_a_rotor_moves_it(changed):
    shin = ('<inertial><origin xyz="0.05 0 0.02"/><mass value="0.4"/>\n'
            '      <inertia ixx="0.004" iyy="0.005" izz="0.006" ixy="0" ixz="0.001" iyz="0"/></inertial>')  # fmt: skip
    assert RigidTree(changed((shin, "")), JOINTS, DOWN).remarks == ()
    ear = ('<inertial><origin xyz="0 0.1 0.1"/><mass value="0.5"/>\n'
           '      <inertia ixx="0.005" iyy="0.004" izz="0.003" ixy="0" ixz="0" iyz="0"/></inertial>')  # fmt: skip
    path = changed((ear, ""))
    RigidTree(path, JOINTS, DOWN)
    assert RigidTree(path, (*JOINTS, "ear"), DOWN, inertias=False).massless == ()
    tree = RigidTree(path, (*JOINTS, "ear"), DOWN)
    assert tree.massless == ("ear",)
    assert tree.remarks == ("arm.urdf: link ear, moved by ear, has no inertia; its rotor has it all",)
    q = np.array([[0.3, -0.2, 0.5, 0.9]])
    assert np.all(tree.mass_matrix(q)[0, 3] == 0.0)
    # noise of the ear is weighed by itself, that of the others as without it
    weighing = tree.weighing_inertia(q)[0]
    np.testing.assert_array_equal(weighing[3], [0.0, 0.0, 0.0, 1.0])
    np.testing.assert_allclose(weighing[:3, :3], RigidTree(path, JOINTS, DOWN).mass_matrix(q[:, :3])[0], rtol=1e-12)
    assert tree.free_inertias()[3] == 1.0


def test_a_chain_without_masses_has_no_equations(tmp_path):
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(re.sub("<inertial>.*?</inertial>", "", MIMICKING.read_text(), flags=re.DOTALL))
    with pytest.raises(RobotError) as error:
        RigidTree(urdf, JOINTS, DOWN)
    assert str(error.value).endswith(
        "has no inertia; the mass matrix is not positive definite, so joint1 has no equation of motion. Give what it "
        "moves a <mass> and an <inertia> in the URDF with positive principal moments, none above the sum of the "
        "others, or leave joint1 out of the joints"
    )
    assert RigidTree(urdf, ("joint3",), DOWN).massless == ("joint3",)


def test_a_mass_on_its_own_axis_without_moments_moves_as_none(changed):
    ear = ('<inertial><origin xyz="0 0.1 0.1"/><mass value="0.5"/>\n'
           '      <inertia ixx="0.005" iyy="0.004" izz="0.003" ixy="0" ixz="0" iyz="0"/></inertial>')  # fmt: skip
    point = ('<inertial><origin xyz="0 0 0"/><mass value="0.5"/>'
             '<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>')  # fmt: skip
    tree = RigidTree(changed((ear, point)), (*JOINTS, "ear"), DOWN)
    assert tree.massless == ("ear",)
    assert "ear moves no inertia; its rotor has it all" in tree.remarks[0]


def test_what_the_parser_leaves_out_is_said(changed):
    tree = RigidTree(changed(('<origin xyz="0.05 0 0.02"/><mass value="0.4"/>', "")), JOINTS, DOWN)
    assert tree.remarks == (
        "arm.urdf: Inertial element must have a mass element",
        "arm.urdf: Could not parse inertial element for Link [shin]",
    )


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('multiplier="0.5"', 'multiplier="half"', "multiplier value (half) is not a valid float"),
        ('<parent link="base"/><child link="paw"/>', '<parent link="bases"/><child link="paw"/>', "Failed to build "
         "tree: parent link [bases] of joint [wave] not found"),
        ('<link name="base"/>', '<link name="base"/><link name="lost"/>', "Failed to find root link: Two root links"),
        ("</robot>", "", "no element found: line"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', "has no axis"),
    ],
)  # fmt: skip
def test_a_urdf_that_cannot_be_read_is_refused_with_the_reason(changed, old, new, told, capfd):
    with pytest.raises(RobotError) as error:
        RigidTree(changed((old, new)), JOINTS, DOWN)
    assert told in str(error.value)
    assert "\n" not in str(error.value)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("place", ['<mass value="${m}"/>', '<origin xyz="0 0 ${h}"/>'])
def test_expressions_of_xacro_in_bodies_are_said_with_the_command_that_expands_them(changed, place):
    urdf = changed(('<link name="base"/>', f'<link name="base"><inertial>{place}</inertial></link>'))
    with pytest.raises(
        RobotError, match=r"arm.urdf is a xacro file \(line \d+: <.*\$\{.\}.*: xacro .*arm_expanded.urdf"
    ):
        RigidTree(urdf, JOINTS, DOWN)


def test_a_link_that_carries_others_without_an_inertia_of_its_own_is_a_remark(tmp_path):
    """What turns with it about an upright axis is found as the inertia of the drive, and no value or sigma tells."""
    body = '<inertial><mass value="3"/><inertia ixx="0.04" iyy="0.04" izz="0.006" ixy="0" ixz="0" iyz="0"/></inertial>'
    joint = '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><axis xyz="{3}"/></joint>'
    pan, lift = joint.format("pan", "base", "turret", "0 0 1"), joint.format("lift", "turret", "arm", "0 1 0")
    links = f'<link name="base"/><link name="turret">%s</link><link name="arm">{body}</link>'
    text = f'<robot name="p">{links}{pan}{lift}</robot>'
    path = tmp_path / "p.urdf"
    path.write_text(text % body)
    assert RigidTree(path, ("pan", "lift"), DOWN).remarks == ()
    path.write_text(text % "")
    (remark,) = RigidTree(path, ("pan", "lift"), DOWN).remarks
    assert remark.startswith("p.urdf: link turret, moved by pan, has no inertia of its own")
    assert "counted to pan.inertia" in remark and "give it a <mass>" in remark
    assert RigidTree(path, ("lift",), DOWN).remarks == ()
