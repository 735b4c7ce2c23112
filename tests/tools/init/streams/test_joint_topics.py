# SPDX-License-Identifier: BSD-3-Clause
"""Commands on one topic for each joint drive the joints that the topics or their messages name."""

from __future__ import annotations

import numpy as np
import pytest
from arm_bags import ArmMotion, write_arm_bag, write_urdf

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.command_line import main

JOINTS = ("base_pan_joint", "elbow_joint", "arm_joint3", "arm_finger_joint3")
PARENTS = {"base_pan_joint": None, "elbow_joint": "base_pan_joint", "arm_joint3": "elbow_joint"}
PARENTS |= {"arm_finger_joint3": "arm_joint3"}
MOVING = JOINTS[:3]
TOPICS = {
    "whole names": ("/base_pan_joint/command", "/elbow_joint/command", "/arm_joint3/command"),
    "controllers": ("/base_pan_controller/command", "/elbow_controller/command", "/arm_joint3_controller/command"),
    "ends of names": ("/pan/command", "/elbow/command", "/arm_joint3/command"),
    "efforts": ("/base_pan_joint/effort", "/elbow_joint/effort", "/arm_joint3/effort"),
    "names at the end": ("/torque_cmd/base_pan_joint", "/torque_cmd/elbow_joint", "/torque_cmd/arm_joint3"),
    "numbers": ("/joint1/command", "/joint2/command", "/joint3/command"),
    "numbers from zero": ("/motor_0/command", "/motor_1/command", "/motor_2/command"),
}


@pytest.fixture(scope="module")
def motion(tmp_path_factory):
    urdf = write_urdf(tmp_path_factory.mktemp("urdf") / "arm.urdf", PARENTS)
    return ArmMotion(urdf, MOVING, {"arm_finger_joint3": 0.1}), urdf


def commands_read(motion, urdf, tmp_path, topics) -> np.ndarray:
    """The torques that a robot file of `init` reads, in the order of MOVING."""
    content = {"/joint_states": motion.states(), **topics}
    bag, robot = write_arm_bag(tmp_path / "a.mcap", motion.times, content), tmp_path / "a.yaml"
    assert main(["init", str(urdf), str(bag), "-o", str(robot)]) == 0
    loaded = load_robot(robot)
    assert loaded.joints == MOVING
    return read_recording(bag, loaded).command.values


@pytest.mark.parametrize("sort", [name for name in TOPICS if name != "numbers"])
@pytest.mark.parametrize("kind", ["std_msgs/msg/Float64", "std_msgs/msg/Float64MultiArray"])
def test_topics_that_name_a_joint_or_count_drive_it(motion, tmp_path, capsys, sort, kind):
    arm, urdf = motion
    order = {topic: joint for topic, joint in zip(TOPICS[sort], MOVING, strict=True)}
    topics = {t: {"type": kind, "data": arm.effort[order[t]][:, None]} for t in sorted(order, reverse=True)}
    found = commands_read(arm, urdf, tmp_path, topics)
    np.testing.assert_allclose(found, arm.torque[: len(found)], rtol=1e-6, atol=1e-6)
    assert "the regression does not explain" not in capsys.readouterr().out


@pytest.mark.parametrize("sort", ["whole names", "numbers", "numbers from zero"])
def test_joint_states_on_topics_of_their_own_say_whose_they_are(motion, tmp_path, sort):
    arm, urdf = motion
    # the topics count the other way round: what the messages say counts
    names = MOVING if sort == "whole names" else MOVING[::-1]
    topics = {topic: arm.commands([name]) for topic, name in zip(TOPICS[sort], names, strict=True)}
    found = commands_read(arm, urdf, tmp_path, topics)
    np.testing.assert_allclose(found, arm.torque[: len(found)], atol=1e-9)


def test_a_number_that_could_be_two_joints_is_not_taken_for_one(motion, tmp_path, capsys):
    arm, urdf = motion
    topics = {
        topic: {"type": "std_msgs/msg/Float64", "data": arm.effort[joint][:, None]}
        for topic, joint in zip(TOPICS["numbers"], MOVING, strict=True)
    }
    bag = write_arm_bag(tmp_path / "a.mcap", arm.times, {"/joint_states": arm.states(), **topics})
    assert main(["init", str(urdf), str(bag), "-o", str(tmp_path / "a.yaml")]) == 1
    assert "commands come joint by joint, on /joint1/command, /joint2/command" in capsys.readouterr().err
