# SPDX-License-Identifier: BSD-3-Clause
"""Trackers of rigid arms whose stamps are late, or ahead, or that were moved, are told with the time."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_arm import Arm, robot_file

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import Topic
from jointscope.robots.recordings.joint_motion import joint_motion
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.robots.recordings.target_plausibility import check_targets

SIGMA = 3e-4  # [m]


def told_of(tmp_path, late=0.0, moved=0.0):
    """Notices about a tracker whose stamps are late [s], and which is moved after five of ten seconds [m]."""
    arm, rng = Arm(), np.random.default_rng(2)
    robot = load_robot(robot_file(arm, tmp_path))
    source = Topic("/trk", "geometry_msgs/msg/PointStamped", "point", "m")
    at, tracker = np.array([0.1, 0.05, -0.2]), np.eye(4)
    target = PositionTarget("trk", source, "of_j2", at, None, tracker, "trk", SIGMA)
    robot = robot.with_sensors({**robot.sensors, "trk": target})
    t, speeds = np.arange(0.0, 10.0, 0.005), rng.uniform(2.0, 6.0, 3)
    q = 0.5 * np.sin(t[:, None] * speeds)
    R, p = robot.tree.body_poses("of_j2", q)
    positions = p + R @ at + SIGMA * rng.standard_normal(p.shape)
    positions[t > 5.0] += np.array([moved, 0.0, 0.0])
    encoder = Stream("encoder", t, q, robot.joints, "rad")
    seen = Stream("trk", t[::4] + late, positions[::4], target.channels, "m")
    recording = Recording("arm.mcap", "", 0, {"encoder": encoder, "trk": seen})
    return [notice.text for notice in check_targets(recording, robot, joint_motion(encoder, robot.motor_encoder.zero))]


@pytest.mark.parametrize(
    ("late", "said"), [(0.03, "is late, by about 30 ms"), (-0.03, "is early, by about 30 ms"), (0.0, "")]
)
def test_stamps_of_a_tracker_are_told(tmp_path, late, said):
    assert [said in text for text in told_of(tmp_path, late)] == ([True] if said else [])


def test_a_tracker_that_was_moved_while_it_measured_is_told_with_the_time(tmp_path):
    (text,) = told_of(tmp_path, moved=0.03)
    assert "trk jumps by 3" in text and "at 5.02 s and stays there: its tracker was moved" in text


def test_a_late_tracker_that_was_moved_is_told_as_both(tmp_path):
    late, moved = told_of(tmp_path, 0.03, 0.05)
    assert "is late, by about 30 ms" in late and "its tracker was moved" in moved
