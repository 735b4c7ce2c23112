# SPDX-License-Identifier: BSD-3-Clause
"""Positions of a tracker in a bag: `init` names them, and writes them as a sensor of the link that the user says."""

from dataclasses import replace

import numpy as np
import pytest

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.command_words import ready_robots
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import Topic
from jointscope.tools.command_line import main

AT, R = np.array([0.1, -0.05, 0.6]), np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
POSE = np.block([[R, np.array([[2.0], [0.5], [1.0]])], [np.zeros((1, 3)), np.ones((1, 1))]])
URDF = ready_robots()["doggy"].with_name("doggy.urdf")


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Two seconds of a stiff Doggy with a target on its last link, in millimetres."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.bags.write_bag import write_bag
    from jointscope.tools.simulator import simulate

    doggy = load_robot("doggy")
    source = Topic("/camera/left_marker/pose", "geometry_msgs/msg/PoseStamped", "pose.position", "mm")
    target = PositionTarget("m", source, "link3", AT, None, POSE, "m", 3e-4)
    robot = replace(doggy, sensors={"motor_encoder": doggy.motor_encoder, "m": target})
    stiff = {f"joint{k}.stiffness": 2e4 for k in (1, 2, 3)}
    path = tmp_path_factory.mktemp("bag") / "run.mcap"
    write_bag(path, simulate(robot, "moves", 4.0, seed=2, friction="smooth", parameters=stiff).recording, robot)
    return path


def init(bag, out, *more):
    return main(["init", str(URDF), str(bag), "-o", str(out), *more])


def test_positions_are_named_with_what_to_type(bag, tmp_path, capsys):
    assert init(bag, tmp_path / "my.yaml") == 0
    told = "/camera/left_marker/pose: positions of something; if it is on a link, `init` again with --target "
    assert told + "/camera/left_marker/pose=LINK (link1, link2, link3, head)" in capsys.readouterr().out
    assert f"# not used: {told}" in (tmp_path / "my.yaml").read_text()
    assert not load_robot(tmp_path / "my.yaml").targets


def test_on_the_link_that_the_user_says_it_is_a_sensor_with_its_tracker(bag, tmp_path, capsys):
    assert init(bag, tmp_path / "my.yaml", "--target", "/camera/left_marker/pose=link3") == 0
    assert "the recording can be used with it" in capsys.readouterr().out
    (target,) = load_robot(tmp_path / "my.yaml").targets
    assert (target.name, target.body, target.source.unit) == ("left_marker", "link3", "mm")
    assert target.source.msgtype == "geometry_msgs/msg/PoseStamped" and target.source.field == "pose.position"
    np.testing.assert_allclose(target.at, AT, atol=0.02)
    np.testing.assert_allclose(target.tracker_pose, POSE, atol=0.03)
    assert target.sigma == pytest.approx(3e-4, rel=0.2)
    robot = load_robot(tmp_path / "my.yaml")
    assert set(target.own) <= set(robot.parameters)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("/camera/left_marker/pose", "expected TOPIC=LINK, the link that carries the target"),
        ("/camera/left=link3", "no topic /camera/left with positions; did you mean '/camera/left_marker/pose'?"),
        ("/camera/left_marker/pose=link7", "no link 'link7' that moves; did you mean 'link"),
    ],
)
def test_what_cannot_be_is_told_in_one_line(bag, tmp_path, capsys, text, told):
    assert init(bag, tmp_path / "my.yaml", "--target", text) == 1
    error = capsys.readouterr().err
    assert f"--target {text}: " in error and told in error and error.count("\n") <= 2
    assert not (tmp_path / "my.yaml").exists()


def test_a_target_on_another_link_than_said_makes_the_recording_unusable(bag, tmp_path, capsys):
    assert init(bag, tmp_path / "my.yaml", "--target", "/camera/left_marker/pose=link1") == 0
    assert "does not move as a point of link1" in capsys.readouterr().out
