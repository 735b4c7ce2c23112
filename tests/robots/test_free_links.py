# SPDX-License-Identifier: BSD-3-Clause
"""Robot files of robots whose masses are not known, and encoders whose zero is not."""

import re
from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.robots.errors import RobotError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.model.command_words import ready_robots
from jointscope.robots.recordings.motor_zero import with_motor_zero
from jointscope.robots.recordings.recording import Recording, Stream


def written(tmp_path, change):
    """The robot file of hebi_2r with a change in its text."""
    text = ready_robots()["hebi_2r"].read_text(encoding="utf-8")
    assert change[0] in text
    path = tmp_path / "arm.yaml"
    text = text.replace("urdf: hebi_2r.urdf", "urdf: ready:hebi_2r/hebi_2r.urdf").replace(*change)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", ["hebi_2r", "hebi_3r", "hebi_5r", "kr300"])
def test_ready_robots_without_masses_can_be_loaded_and_written_again(name, tmp_path):
    robot = load_robot(name)
    spring = add_effect(robot, f"joint_elasticity@{robot.joints[0]}", {"compliance": 0.01})
    (tmp_path / "again.yaml").write_text(robot_text(spring, tmp_path), encoding="utf-8")
    again = load_robot(tmp_path / "again.yaml")
    assert again.parameters == spring.parameters
    assert again.sensors.keys() == robot.sensors.keys()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("rigid_joints: [joint1, joint2]", "rigid_joints: [joint1]"), "begins with rigid joints; list joint2 under"),
        (("unit: N m", "unit: V"), "expected 'N m', got 'V'"),
        (("kind: gyro  ", "kind: joint_torque"), "unknown key|expected 'N m'"),
    ],
)
def test_files_that_do_not_fit_together_are_refused_with_what_to_do(tmp_path, change, message):
    with pytest.raises(RobotError, match=message):
        load_robot(written(tmp_path, change))


def test_free_links_need_an_encoder_on_them(tmp_path):
    path = written(tmp_path, ("free ", "free "))
    text = path.read_text(encoding="utf-8")
    start, end = text.index("  link_encoder:"), text.index("  joint_torque:")
    path.write_text(text[:start] + text[end:], encoding="utf-8")
    with pytest.raises(RobotError, match="link_dynamics: free needs a sensor of kind link_encoder, got none"):
        load_robot(path)


TORQUE = """  torque:
    {kind: joint_torque, topic: /link_states, type: sensor_msgs/msg/JointState, field: effort, unit: N m, sigma: 0.1}
  imu1:
"""


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("sigma: 6.9259e-5", "zero: unknown\n    sigma: 6.9259e-5"), "zero: unknown needs link_dynamics: free"),
    ],
)
def test_what_belongs_to_free_links_is_refused_where_masses_are_known(tmp_path, change, message):
    text = (
        ready_robots()["doggy"].read_text(encoding="utf-8").replace("urdf: doggy.urdf", "urdf: ready:doggy/doggy.urdf")
    )
    (tmp_path / "doggy.yaml").write_text(text.replace(*change), encoding="utf-8")
    with pytest.raises(RobotError, match=message):
        load_robot(tmp_path / "doggy.yaml")


def test_a_torque_sensor_needs_a_spring_at_every_joint(tmp_path):
    text = ready_robots()["xl330_pendulum"].read_text(encoding="utf-8")
    text = text.replace("urdf: xl330", "urdf: ready:xl330_pendulum/xl330")
    sensor = TORQUE.removesuffix("  imu1:\n")
    (tmp_path / "x.yaml").write_text(re.sub(r"(?m)^sensors:.*\n", f"sensors:\n{sensor}", text), encoding="utf-8")
    with pytest.raises(RobotError, match=r"measured at the spring of a joint, and .* has none; .*joint_elasticity@"):
        load_robot(tmp_path / "x.yaml")


def test_what_needs_equations_of_motion_says_so():
    times = np.arange(200) / 100.0
    stream = Stream("command", times, np.zeros((200, 2)), ("a", "b"), "1")
    with pytest.raises(RobotError, match="no equations of motion to predict with; `calibrate` and `discover`"):
        BagProblem.of(load_robot("hebi_2r"), Recording("x", "", 0, {"command": stream}))


def test_an_unknown_zero_of_the_motors_is_taken_from_the_links():
    robot, times = load_robot("hebi_2r"), np.arange(200) / 100.0
    link = np.column_stack([np.sin(times), np.cos(times)])
    streams = {
        "motor_encoder": Stream("motor_encoder", times, link + np.array([3.0, -40.0]), ("a", "b"), "rad"),
        "link_encoder": Stream("link_encoder", times, link, ("a", "b"), "rad"),
    }
    found = with_motor_zero(Recording("x", "", 0, streams), robot)
    np.testing.assert_allclose(found.streams["motor_encoder"].values, link, atol=1e-12)
    known = replace(robot.motor_encoder, zero_known=True)
    same = with_motor_zero(found, robot.with_sensors({"motor_encoder": known}))
    assert same is found


def test_a_gear_in_the_command_is_read_and_must_fit_the_joints(tmp_path):
    assert load_robot("kr300").command.scale[1] == pytest.approx(1872 / 7)
    with pytest.raises(RobotError, match="scale"):
        load_robot(written(tmp_path, ("  unit: duty", "  unit: duty\n  scale: [1.0]")))


def test_channels_of_a_torque_sensor_may_have_signs_and_units_of_their_own(tmp_path):
    robot = load_robot(written(tmp_path, ("kind: joint_torque", "kind: joint_torque\n    scale: [-1, 0.001]")))
    np.testing.assert_array_equal(robot.torque_sensor.source.factor, [-1.0, 0.001])
    (tmp_path / "again.yaml").write_text(robot_text(robot, tmp_path), encoding="utf-8")
    assert load_robot(tmp_path / "again.yaml").torque_sensor.source.scale == (-1.0, 0.001)
