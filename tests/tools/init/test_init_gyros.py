# SPDX-License-Identifier: BSD-3-Clause
"""`init`: units, signs and hands of sensors, by what encoders and gyroscopes say about the same motion."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from arm_bags import ArmMotion, write_arm_bag, write_urdf

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.screening import screen
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.command_line import main

ARM = {"shoulder": None, "elbow": "shoulder", "wrist": "elbow"}
CASES = Path(__file__).resolve().parents[3].parent / "shared" / "cases"
needs_cases = pytest.mark.skipif(not CASES.is_dir(), reason="shared/cases is not beside the project")
MOUNTED = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
MIRROR = np.diag([-1.0, 1.0, 1.0])


def init(*arguments):
    return main(["init", *map(str, arguments)])


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    return write_urdf(tmp_path_factory.mktemp("arms") / "arm.urdf", ARM)


@pytest.fixture(scope="module")
def motion(arm):
    return ArmMotion(arm, tuple(ARM), seconds=4.0)


def guessed(arm, motion, folder, encoder=1.0, command=1.0, gyro=None, unit=1.0):
    """The robot of a bag whose encoders, commands and gyroscope were changed."""
    states, commands = motion.states(tuple(ARM)), motion.commands(tuple(ARM))
    states["position"] = states["position"] * np.asarray(encoder)
    commands["effort"] = commands["effort"] * np.asarray(command)
    rate = motion.gyro("wrist_link", MOUNTED) * unit
    topics = {
        "/joint_states": states,
        "/cmd": commands,
        "/imu/data": {"rate": rate if gyro is None else rate @ gyro.T},
    }
    bag = write_arm_bag(folder / "a.mcap", motion.times, topics)
    assert init(arm, bag, "-o", folder / "a.yaml") == 0
    robot = load_robot(folder / "a.yaml")
    return robot, read_recording(bag, robot)


def test_all_as_it_should_be_changes_nothing(arm, motion, tmp_path):
    robot, _ = guessed(arm, motion, tmp_path)
    (gyro,) = robot.gyros
    np.testing.assert_allclose(gyro.R_imu_body, MOUNTED, atol=1e-9)
    assert gyro.body == "wrist_link" and not gyro.left_handed
    assert robot.motor_encoder.source.unit == "rad" and not any(np.array(robot.motor_encoder.source.scale) < 0)


@pytest.mark.parametrize(("unit", "factor"), [("turn", 1.0 / (2.0 * np.pi)), ("deg", 180.0 / np.pi)])
@pytest.mark.parametrize(("gyro_unit", "gyro_factor"), [("rad/s", 1.0), ("deg/s", 180.0 / np.pi)])
def test_the_unit_of_the_encoders_is_that_of_the_rates(arm, motion, tmp_path, unit, factor, gyro_unit, gyro_factor):
    robot, recording = guessed(arm, motion, tmp_path, encoder=factor, unit=gyro_factor)
    assert robot.motor_encoder.source.unit == unit
    assert robot.gyros[0].source.unit == gyro_unit
    np.testing.assert_allclose(recording.streams["motor_encoder"].values, motion.q, atol=1e-3)


def test_a_left_handed_gyro_is_written_read_and_named(arm, motion, tmp_path):
    robot, recording = guessed(arm, motion, tmp_path, gyro=MIRROR)
    (gyro,) = robot.gyros
    assert gyro.left_handed
    np.testing.assert_allclose(gyro.R_imu_body, MOUNTED, atol=1e-9)
    np.testing.assert_allclose(recording.streams["imu"].values, motion.gyro("wrist_link", MOUNTED), atol=1e-9)
    assert not [notice for notice in screen(recording, robot) if notice.kind in ("axes", "mirrored")]
    text = (tmp_path / "a.yaml").read_text().replace("left_handed: true", "left_handed: false")
    (tmp_path / "right.yaml").write_text(text)
    robot = load_robot(tmp_path / "right.yaml")
    said = [n.text for n in screen(read_recording(tmp_path / "a.mcap", robot), robot) if n.kind == "mirrored"]
    assert "set `left_handed: true` of sensors.imu, or a joint counts backwards" in said[0]


def test_a_mirrored_gyro_in_other_axes_is_named_with_its_rotation(arm, motion, tmp_path):
    robot, _ = guessed(arm, motion, tmp_path, gyro=np.diag([1.0, 1.0, -1.0]))
    assert robot.gyros[0].left_handed
    np.testing.assert_allclose(robot.gyros[0].R_imu_body, MIRROR @ np.diag([1.0, 1.0, -1.0]) @ MOUNTED, atol=1e-9)
    rows = "[" + ", ".join("[" + ", ".join(f"{x:g}" for x in row) + "]" for row in MOUNTED) + "]"
    text = (tmp_path / "a.yaml").read_text().replace("left_handed: true", "left_handed: false")
    (tmp_path / "right.yaml").write_text(_with_rotation(text, rows))
    robot = load_robot(tmp_path / "right.yaml")
    said = [n.text for n in screen(read_recording(tmp_path / "a.mcap", robot), robot) if n.kind == "mirrored"]
    assert "set `left_handed: true` of sensors.imu and its R_imu_body to [[0, -1, 0], [0, 0, 1], [-1, 0, 0]]" in said[0]


def _with_rotation(text, rows):
    lines = text.splitlines()
    place = next(k for k, line in enumerate(lines) if "R_imu_body:" in line) + 1
    lines[place] = f"      value: {rows}"
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("ratios", [(50.0, 50.0, 50.0), (120.0, 80.5, 33.0), (1.5, 1.0, 2.0)])
def test_positions_before_gears_are_scaled_by_what_the_gyroscopes_say(arm, motion, tmp_path, ratios):
    robot, recording = guessed(arm, motion, tmp_path, encoder=ratios)
    assert robot.motor_encoder.source.unit == "rad"
    np.testing.assert_allclose(robot.motor_encoder.source.scale, 1.0 / np.array(ratios), rtol=2e-3)
    np.testing.assert_allclose(recording.streams["motor_encoder"].values, motion.q, atol=3e-3)
    np.testing.assert_allclose(robot.motor_encoder.sigmas, 2e-5, rtol=0.2)


@pytest.mark.parametrize("joint", [0, 1, 2])
def test_a_joint_that_counts_backwards_is_told_by_its_command(arm, motion, tmp_path, joint):
    signs = np.where(np.arange(3) == joint, -1.0, 1.0)
    robot, recording = guessed(arm, motion, tmp_path, encoder=signs)
    assert not robot.gyros[0].left_handed
    np.testing.assert_allclose(recording.streams["motor_encoder"].values, motion.q, atol=1e-3)
    np.testing.assert_allclose(recording.command.values, motion.torque)


def test_fifty_joints_with_a_gyro_at_the_end_take_seconds(tmp_path):
    names = [f"j{k}" for k in range(50)]
    urdf = write_urdf(tmp_path / "snake.urdf", dict(zip(names, [None, *names], strict=False)))
    moving = names[::6]
    motion = ArmMotion(urdf, moving, {name: 0.1 for name in names if name not in moving}, seconds=3.0, rate=100.0)
    signs = {name: -1.0 if name == moving[3] else 1.0 for name in names}
    states = motion.states(names)
    states["position"] = states["position"] * np.array([signs[name] for name in names])
    topics = {
        "/joint_states": states,
        "/cmd": motion.commands(names),
        "/imu/data": {"rate": motion.gyro("j49_link", MOUNTED)},
        "/base_imu/data": {"rate": 1e-3 * np.random.default_rng(0).standard_normal((len(motion.times), 3))},
    }
    bag = write_arm_bag(tmp_path / "a.mcap", motion.times, topics)
    begin = time.process_time()
    assert init(urdf, bag, "-o", tmp_path / "a.yaml") == 0
    assert time.process_time() - begin < 15.0
    robot = load_robot(tmp_path / "a.yaml")
    assert robot.joints == tuple(moving)
    seen = read_recording(bag, robot).streams["motor_encoder"].values
    np.testing.assert_allclose(seen, motion.q, atol=1e-3)


@needs_cases
def test_the_cases_of_units_and_hands_are_recognised(tmp_path):
    urdf = load_robot("doggy").tree.urdf
    assert init(urdf, CASES / "encoders_in_turns.mcap", "-o", tmp_path / "turns.yaml") == 0
    assert load_robot(tmp_path / "turns.yaml").motor_encoder.source.unit == "turn"
    assert init(urdf, CASES / "left_handed_imu2.mcap", "-o", tmp_path / "left.yaml") == 0
    robot = load_robot(tmp_path / "left.yaml")
    assert [gyro.left_handed for gyro in robot.gyros] == [False, True]
    assert robot.motor_encoder.source.scale in ((), (1.0, 1.0, 1.0))
    np.testing.assert_allclose(robot.gyros[1].R_imu_body, load_robot("doggy").gyros[1].R_imu_body, atol=1e-6)
