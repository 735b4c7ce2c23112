# SPDX-License-Identifier: BSD-3-Clause
"""The section `transmission`: matrix or radii in, calibrated elements out, and one line for what cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.robots.errors import RobotError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.model.command_words import ready_robots

MATRIX = "matrix: [[1, 0, 0], [0.2, 0.9, 0], [0, 0, 1]]"
ELEMENT = "joint2.from_joint1: {value: 0.2, unit: rad/rad, positive: false}"


def robot_of(tmp_path, transmission, parameter="", change=lambda text: text):
    text = ready_robots()["doggy"].read_text(encoding="utf-8")
    text = text.replace("urdf: doggy.urdf", "urdf: ready:doggy/doggy.urdf")
    text = text.replace("\nmodel:", f"\ntransmission:\n  {transmission}\n\nmodel:", 1)
    head, body = text.split("\nparameters:", 1)
    comment, rest = body.split("\n", 1)
    text = f"{head}\nparameters:{comment}\n" + (f"  {parameter}\n" if parameter else "") + rest
    (tmp_path / "arm.yaml").write_text(change(text), encoding="utf-8")
    return load_robot(tmp_path / "arm.yaml")


def test_a_matrix_is_read_and_the_identity_is_none(tmp_path):
    np.testing.assert_array_equal(robot_of(tmp_path, MATRIX).transmission, [[1, 0, 0], [0.2, 0.9, 0], [0, 0, 1]])
    assert robot_of(tmp_path, "matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]").transmission is None


def test_radii_are_those_of_ropes_that_do_not_stretch(tmp_path):
    radii = "radii: {joint2: {motor: 0.01, joint: 0.02}, joint3: {motor: 0.01, joint: 0.04, over: {joint2: 0.005}}}"
    T = robot_of(tmp_path, radii).transmission
    # joint 2 turns by r/R of its motor; with motor 3 held the idler's rope turns joint 3 back by its share
    np.testing.assert_allclose(T, [[1, 0, 0], [0, 0.5, 0], [0, -0.5 * 0.005 / 0.04, 0.25]], atol=1e-15)


def test_calibrated_elements_are_written_into_parameter_and_matrix(tmp_path):
    for section in (MATRIX, "radii: {joint2: {motor: 0.01, joint: 0.02, over: {joint1: 0.005}}}"):
        value = 0.2 if section == MATRIX else -0.25
        robot = robot_of(tmp_path, section, ELEMENT.replace("0.2", str(value)))
        text = robot_text(robot.with_values({"joint2.from_joint1": 0.31}), tmp_path)
        (tmp_path / "again.yaml").write_text(text, encoding="utf-8")
        again = load_robot(tmp_path / "again.yaml")
        assert again.transmission[1, 0] == again.parameter("joint2.from_joint1").value == 0.31


@pytest.mark.parametrize(
    ("section", "parameter", "expected"),
    [
        (
            "matrix: [[1, 0], [0, 1]]",
            "",
            "transmission.matrix: expected 3 rows of 3 numbers, in the order joint1, joint2, joint3, got rows of 2, 2",
        ),
        ("matrix: 7", "", "expected 3 rows of 3 numbers, in the order joint1, joint2, joint3, got 7"),
        (
            "matrix: [[1, 1, 0], [1, 1, 0], [0, 0, 1]]",
            "",
            "singular: turning the motors of joint1, joint2 together moves no joint; check signs and zeros",
        ),
        ("matrix: [[1, 0, 0], [0, 0, 0], [0, 0, 1]]", "", "singular: turning the motors of joint2 together moves no"),
        (
            "matrix: [[1, 1, 0], [1, 1.000001, 0], [0, 0, 1]]",
            "",
            "badly scaled (condition 4e+06, at most 1e+04); angles of motors are those after the gear",
        ),
        ("matrix: [[1, 0, 0], [0, 1.0e-6, 0], [0, 0, 1]]", "", "badly scaled (condition 1e+06"),
        ("matrix: [[1, 0, 0], [0, .nan, 0], [0, 0, 1]]", "", "expected 3 x 3 finite numbers"),
        ("{}", "", "transmission: expected either matrix or radii, got neither"),
        ("radii: {joint9: {motor: 1, joint: 1}}", "", "radii: no joint 'joint9'"),
        ("radii: {joint2: {motor: 0, joint: 1}}", "", "radii.joint2.motor: expected a number above zero, got 0"),
        ("radii: {joint2: {motor: 1, joint: 1, over: {joint2: 1}}}", "", "joint2 is the rope's own joint"),
        (f"{MATRIX}\n  radii: {{}}", "", "expected either matrix or radii"),
        (MATRIX, ELEMENT.replace("0.2", "0.3"), "joint2.from_joint1: 0.3, but transmission has 0.2 in row 2, column 1"),
        (MATRIX, ELEMENT.replace("rad/rad", "rad"), "joint2.from_joint1.unit: expected 'rad/rad', got 'rad'"),
    ],
)
def test_what_cannot_be_is_one_line_that_says_what_to_do(tmp_path, section, parameter, expected):
    with pytest.raises(RobotError) as err:
        robot_of(tmp_path, section, parameter)
    assert expected in str(err.value) and "\n" not in str(err.value)


def test_a_rigid_joint_behind_a_coupling_is_refused_with_the_command_that_helps(tmp_path):
    with pytest.raises(RobotError, match=r"joint2 is moved by other motors .* add .*arm.yaml joint_elasticity@joint2"):
        robot_of(
            tmp_path, MATRIX, change=lambda text: text.replace("\nmodel:", "\nmodel:\n  rigid_joints: [joint2]", 1)
        )
