# SPDX-License-Identifier: BSD-3-Clause
"""A recording of motion from a bag: one of rests under known loads is none, since motion knows nothing of loads."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.robots.recordings.still_stretches import OFTEN, share_of, standing
from jointscope.tools.bags.errors_of import errors_of
from jointscope.tools.bags.load_topic import LOAD, largest_load
from jointscope.tools.bags.messages.open_bag import Progress
from jointscope.tools.bags.read_recording import read_recording

REST_TOUR = "rests"  # kind of the notice of a recording of motion that looks like one of rests
MANY_RESTS = 10  # stretches in which motors stand, from which a recording looks like one of rests


def read_motion(path: str | Path, robot: Robot, progress: Progress | None = None) -> Recording:
    """Reads a recording of motion.

    Args:
        path: a ROS 1 .bag, a ROS 2 folder, a .db3 or an .mcap.
        robot: says which topics, fields, units and joint names.
        progress: called with the number of messages read and expected.

    Raises:
        RecordingError: as of `read_recording`, or known loads hang on the arm.
    """
    with errors_of(path):
        recording = read_recording(path, robot, progress)
    largest = largest_load(Path(path))
    call = f"jointscope calibrate {robot_argument(robot)} --rests {shlex.quote(str(path))}"
    if largest > 0.0:
        raise RecordingError(
            f"{path}: loads of up to {largest:.3g} N hang on the arm ({LOAD}); expected motion, which knows of none; "
            f"what such a recording tells are rests: {call} -o {edited_argument(robot, 'calibrated')}"
        )
    share, count = rests_in(recording, robot)
    if not count:
        return recording
    text = (
        f"the motors stand {100 * share:.0f} % of the time, in {count} places; where rests are all that "
        f"it is about, springs, friction and weights come out of them in seconds: {call}"
    )
    notice = Notice(robot.motor_encoder.name, REST_TOUR, count, text)
    return replace(recording, notices=[*recording.notices, notice])


def rests_in(recording: Recording, robot: Robot) -> tuple[float, int]:
    """Part of the time that motors stand, and in how many places; 0 places where it looks like motion."""
    stretches = standing(recording, robot)
    share = share_of(stretches, recording.streams[robot.motor_encoder.name].times)
    many = len(stretches) >= MANY_RESTS and share > OFTEN and not robot.free_links
    return share, len(stretches) * many
