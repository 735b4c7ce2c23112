# SPDX-License-Identifier: BSD-3-Clause
"""Names of joints in messages are found by what they end with, and what could be two joints is said."""

from __future__ import annotations

from jointscope.tools.init.streams.joint_names import match_names


def test_names_are_matched_by_the_longest_common_ending():
    joints = ("arm_left_1", "arm_left_2", "arm_right_1", "panda_joint3", "Elbow_joint")
    names = ("right_1", "elbow", "joint_3", "left_2", "robot::left_1")
    assert match_names(joints, names).found == {
        "arm_left_1": "robot::left_1",
        "arm_left_2": "left_2",
        "arm_right_1": "right_1",
        "panda_joint3": "joint_3",
        "Elbow_joint": "elbow",
    }
    assert match_names(("left_hip",), ("right_hip",)).found == {}
    assert match_names(("a_1", "b_1"), ("1", "2")).found == {}


def test_what_could_be_two_joints_belongs_to_none():
    match = match_names(("left_joint1", "right_joint1"), ("joint1",))
    assert match.found == {} and match.ambiguous == (("joint1", ("left_joint1", "right_joint1")),)
    match = match_names(("joint1",), ("left/joint1", "right/joint1"))
    assert match.found == {} and match.ambiguous == (("joint1", ("left/joint1", "right/joint1")),)
    assert match_names(("joint1", "left_joint1"), ("joint1", "left_joint1")).ambiguous == ()
