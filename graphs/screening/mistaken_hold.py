# SPDX-License-Identifier: BSD-3-Clause
"""Drive signals that the robot file says are held, and the motion says run on between samples, or the reverse."""

from __future__ import annotations

from jointscope.graphs.starts.drive_signal import acts_until_the_next
from jointscope.graphs.starts.drive_starts import driven_joints
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice, Recording

MISTAKEN_HOLD = "held"  # kind of its notices
ACTS = {True: "acts until its next sample, as a command does", False: "was measured and runs on between samples"}


def held_otherwise(robot: Robot) -> str:
    """What to write so that the drive signal is the other of the two."""
    return f"`held: {str(not robot.command_held).lower()}` in the section command of {robot_argument(robot)}"


def mistaken_hold(recording: Recording, robot: Robot) -> list[Notice]:
    """A sentence where the motion of rigid joints contradicts `held` of the file; nothing where springs hide it.

    Args:
        recording: what was measured.
        robot: as its file has it.
    """
    if robot.command.held is None or robot.layout.motors or robot.free_links:
        return []
    robot, sigmas = robot.in_posture(recording.posture), robot.motor_encoder.sigmas
    try:
        told = acts_until_the_next(robot.tree, driven_joints(robot, [recording]), sigmas, robot.friction_sharpness())
    except RecordingError:  # streams that do not overlap: others say so
        return []
    if told is None or told == robot.command_held:
        return []
    text = (
        f"the motion says that the drive signal on {robot.command.topic} {ACTS[told]}, while the robot file says that "
        f"it {ACTS[not told]}: constants, friction and times would be wrong; if that is so, write "
        f"{held_otherwise(robot)}"
    )
    return [Notice("command", MISTAKEN_HOLD, 0, text)]
