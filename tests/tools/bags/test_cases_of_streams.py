# SPDX-License-Identifier: BSD-3-Clause
"""Small recordings that reproduce what users of such tools report, read right."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.fixed_lag.replay.replay import replay
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.screening import screen
from jointscope.tools.bags.descriptions.describe_bag import describe_bag
from jointscope.tools.bags.read_arrivals import ArrivalReader
from jointscope.tools.bags.read_recording import read_recording

CASES = Path(__file__).resolve().parents[3].parent / "shared" / "cases"
pytestmark = pytest.mark.skipif(not CASES.is_dir(), reason="shared/cases is not beside the project")
WHAT_WAS_DONE = ("foreign", "glitch", "dropped", "posture", "clock", "gap", "staircase")


@pytest.fixture(scope="module")
def doggy():
    return load_robot("doggy")


def read(name, robot):
    return read_recording(CASES / f"{name}.mcap", robot)


def done(recording):
    return [notice.text for notice in recording.notices if notice.kind in WHAT_WAS_DONE]


@pytest.fixture(scope="module")
def clean(doggy):
    """Encoders of the same simulation, in which only an unrelated topic is odd."""
    return read("camera_imu_stamp_zero", doggy).streams["motor_encoder"]


@pytest.mark.parametrize(
    ("name", "lost", "said"),
    [
        ("camera_imu_stamp_zero", [], []),
        ("gripper_on_same_topic", [], ["motor_encoder: left out 36 messages of other joints (finger_joint)"]),
        ("one_empty_position", None, ["motor_encoder: left out 1 message without values"]),
        (
            "first_stamps_zero",
            [0, 1, 2, 3, 4],
            [
                f"{stream}: left out 5 messages at the start whose stamp is zero: the driver had not filled it"
                for stream in ("command", "motor_encoder", "imu1", "imu2")
            ],
        ),
    ],
)
def test_one_odd_message_costs_no_other(doggy, clean, name, lost, said):
    recording = read(name, doggy)
    screen(recording, doggy)
    assert done(recording) == said
    values = recording.streams["motor_encoder"].values
    if lost is None:
        assert len(values) == len(clean) - 1 and {*map(tuple, values)} <= {*map(tuple, clean.values)}
    else:
        assert values.tobytes() == np.delete(clean.values, lost, axis=0).tobytes()
    problem = describe_bag(CASES / f"{name}.mcap", doggy).problem
    # nothing of the streams stands in the way; a recording of a second in which a joint rests is short of motion
    assert problem is None or "joint3 does not move" in problem or "joint3 never moves" in problem, problem


def test_glitch_and_second_publisher_leave_the_same_motion(doggy):
    glitch, zeros = read("one_encoder_glitch", doggy), read("dummy_publisher_zeros", doggy)
    assert done(glitch) == [
        "motor_encoder: left out 1 wild sample (a glitch) at 1.400 s after its start: joint1.motor_position reads 0 "
        "between 0.668756 and 0.671503"
    ]
    assert done(zeros) == [
        "motor_encoder: left out 20 messages of a second node that publishes always the same (0, 0, 0) between those "
        "of the driver, 1000 messages; stop it: `ros2 topic info -v` names it"
    ]
    a, b = glitch.streams["motor_encoder"], zeros.streams["motor_encoder"]
    (missing,) = np.flatnonzero(~np.isin(b.times, a.times))
    assert np.delete(b.values, missing, axis=0).tobytes() == a.values.tobytes()
    for recording in (glitch, zeros):
        screen(recording, doggy)


def test_a_held_elbow_carries_its_weight_where_it_stands():
    robot = load_robot(CASES / "held_elbow.yaml")
    recording = read("held_elbow", robot)
    assert recording.posture == {"elbow": pytest.approx(2.0, abs=1e-3)}
    assert done(recording) == ["held where the bag has them: elbow at 2 rad"]
    result = calibrate(robot, [recording])
    truth = {"torque_constant": 2.0, "coulomb_torque": 0.5, "motor_viscous.coefficient": 0.4}
    for name, true in truth.items():
        found = result.robot.parameters[f"shoulder.{name}"]
        assert abs(found.value - true) < 4.0 * found.sigma and found.sigma < 1e-3


def test_a_replay_leaves_out_what_does_not_fit(doggy):
    for name, said in (
        ("gripper_on_same_topic", ["motor_encoder: left out 36 messages of other joints (finger_joint)"]),
        ("one_empty_position", ["motor_encoder: left out 1 message without values"]),
        (
            "first_stamps_zero",
            [f"{s}: left out 5 messages whose stamp is zero" for s in ("command", "motor_encoder", "imu1", "imu2")],
        ),
    ):
        reader = ArrivalReader(CASES / f"{name}.mcap", doggy)
        (block,) = list(reader)
        recording = read(name, doggy)
        assert len(block) == recording.sample_count
        assert reader.start_ns == recording.start_ns and block.stamps.min() == 0.0
        assert reader.notices() == said


def test_a_replay_in_small_blocks_passes_blocks_of_foreign_messages(doggy):
    blocks = list(ArrivalReader(CASES / "gripper_on_same_topic.mcap", doggy, block=7))
    assert sum(map(len, blocks)) == 2400


def test_a_replay_tells_a_measured_drive_from_a_held_command():
    true = {"torque_constant": 2.0, "coulomb_torque": 0.5, "motor_viscous.coefficient": 0.4}
    robot = load_robot(CASES / "measured_effort.yaml").with_values({f"shoulder.{k}": v for k, v in true.items()})
    robot = replace(robot, noise=replace(robot.noise, link_velocity=np.array([1e-3])))  # next to none, as is true
    assert replay(robot, ArrivalReader(CASES / "measured_effort.mcap", robot)).nis_mean < 1.2
    held = replace(robot, command=replace(robot.command, held=True))
    assert replay(held, ArrivalReader(CASES / "measured_effort.mcap", held)).nis_mean > 10.0
