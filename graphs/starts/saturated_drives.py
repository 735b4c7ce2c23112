# SPDX-License-Identifier: BSD-3-Clause
"""Drives that give less than was commanded, where the robot file knows of no limit, and what to type then."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from jointscope.graphs.starts.command_limits import CommandLimit, command_limits
from jointscope.graphs.starts.drive_starts import LIMIT, driven_joints
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.robots.recordings.screening import screen
from jointscope.robots.units import si_unit

SATURATION = "saturation"  # kind of its notices


def screen_all(recording: Recording, robot: Robot, every_joint: bool = False) -> list[Notice]:
    """What `screen` says of a recording, and drives that saturate.

    Args:
        recording: what was measured.
        robot: what it was measured on.
        every_joint: demand that every joint moves.

    Raises:
        RecordingError: as the screening says.
    """
    return [*screen(recording, robot, every_joint), *saturated_drives(robot, [recording])]


def saturated_drives(robot: Robot, recordings: Sequence[Recording]) -> list[Notice]:
    """A sentence about drives that give no more than a level; nothing where the robot file models it.

    Args:
        robot: the model; masses must be known, and every motor moves its own joint.
        recordings: of it, at least one.
    """
    command = robot.command
    reported = command.topic == robot.motor_encoder.source.topic  # what motors report is what they gave
    if reported or robot.free_links or robot.transmission is not None or not robot.command_held:
        return []
    robot = robot.in_posture(recordings[0].posture)
    try:
        found = command_limits(robot.tree, driven_joints(robot, recordings), robot.motor_encoder.sigmas)
    except RecordingError:  # streams that do not overlap: others say so
        return []
    told = {
        joint: limit
        for joint, limit in zip(robot.joints, found, strict=True)
        if limit is not None and not robot.has_effect(LIMIT, joint)
    }
    if not told:
        return []
    count = sum(round(limit.share * len(recordings[0].command)) for limit in told.values())
    return [Notice("command", SATURATION, count, _sentence(robot, told))]


def _sentence(robot: Robot, told: dict[str, CommandLimit]) -> str:
    listed = ", ".join(
        f"{joint} less than was commanded (how much less its spring hides)"
        if joint in robot.layout.motors
        else f"{joint} no more than {limit.level:.4g}{_unit(robot, joint)} ({100.0 * limit.share:.2g} % of its "
        "commands are beyond)"
        for joint, limit in told.items()
    )
    effects = " ".join(shlex.quote(f"{LIMIT}@{joint}") for joint in told)
    output = edited_argument(robot, "limited")
    return (
        f"command: drives saturate; whatever is commanded, the motion shows of {listed}: values would be wrong; "
        f"`jointscope add {robot_argument(robot)} {effects} -o {output}` models it and finds the levels, or record the "
        "effort that the motors report, or move more gently"
    )


def _unit(robot: Robot, joint: str) -> str:
    unit = robot.unit_at(joint, si_unit(robot.command.unit))
    return "" if unit == "1" else f" {unit}"
