# SPDX-License-Identifier: BSD-3-Clause
"""Drives that give less than was commanded, where the robot file knows of no limit, and what to type then."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

import numpy as np

from jointscope.graphs.starts.command_limits import CommandLimit, limits_in, windows_of_drives
from jointscope.graphs.starts.drive_starts import LIMIT, driven_joints
from jointscope.graphs.starts.encoder_jumps import JUMP, jump_notices
from jointscope.graphs.starts.uneven_limits import WIDTH, UnevenLimit, uneven_limit
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.command_words import bag_arguments, edited_argument, robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.imu_plausibility import MIRRORED
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.robots.recordings.screening import screen
from jointscope.robots.units import si_unit

SATURATION = "saturation"  # kind of its notices
PLAIN_MISTAKES = ("unit", "axes", MIRRORED, SATURATION, JUMP)
"""Kinds of notices that say what is wrong in a robot file, or that a recording is one of two robots."""
FALLS = 0.1  # of a level that is gone at the largest speed, from which it falls with speed
MARGIN = 0.02  # [s] before and after commands beyond a limit
NEAR = 0.15  # [s] between moments that are left out as one
MOST_LEFT_OUT, MOST_STRETCHES = 0.5, 30  # share of the recording, and how often


def screen_all(recording: Recording, robot: Robot, every_joint: bool = False) -> list[Notice]:
    """What `screen` says of a recording, encoders on links that jump, and drives that saturate.

    Args:
        recording: what was measured.
        robot: what it was measured on.
        every_joint: demand that every joint moves.

    Raises:
        RecordingError: as the screening says.
    """
    screened = screen(recording, robot, every_joint)
    return [*screened, *jump_notices(recording, robot), *saturated_drives(robot, [recording])]


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
        windows = windows_of_drives(robot.tree, driven_joints(robot, recordings), robot.motor_encoder.sigmas)
    except RecordingError:  # streams that do not overlap: others say so
        return []
    unknown = [joint for joint in robot.joints if not robot.has_effect(LIMIT, joint)]
    # three numbers for each joint explain much that a spring does
    rigid = [joint for joint in unknown if joint not in robot.layout.motors]
    uneven = {joint: uneven_limit(windows[WIDTH], robot.joints.index(joint)) for joint in rigid}
    told_uneven = {joint: limit for joint, limit in uneven.items() if limit is not None}
    if told_uneven:
        shares = sum(limit.share for limit in told_uneven.values())
        count = round(shares * len(recordings[0].command))
        return [Notice("command", SATURATION, count, _of_uneven(robot, recordings, told_uneven))]
    found = dict(zip(robot.joints, limits_in(windows, robot.n), strict=True))
    told = {joint: limit for joint in unknown if (limit := found[joint]) is not None}
    if not told:
        return []
    count = sum(round(limit.share * len(recordings[0].command)) for limit in told.values())
    return [Notice("command", SATURATION, count, _sentence(robot, told))]


def _of_uneven(robot: Robot, recordings: Sequence[Recording], told: dict[str, UnevenLimit]) -> str:
    """What no effect of the catalogue models, and what can be done with the rest of the recordings."""
    listed = ", ".join(
        f"{joint} {_levels(limit, _unit(robot, joint), robot.unit_at(joint, 'rad/s'))}" for joint, limit in told.items()
    )
    slowed = any(limit.falls > FALLS for limit in told.values())
    why = "; a limit that falls with speed is that of a supply voltage (back-EMF)" if slowed else ""
    return (
        f"command: drives saturate; whatever is commanded, the motion shows of {listed}{why}: values would be wrong; "
        f"{_without(robot, recordings, told)}record the effort that the motors report, or move more gently"
    )


def _levels(limit: UnevenLimit, unit: str, rate: str) -> str:
    """Both levels in words."""
    sides = ((limit.upper, "forwards"), (limit.lower, "backwards"))
    given = " and ".join(f"{level:.3g}{unit} {side}" for level, side in sides if level < float("inf"))
    falls = f", {limit.slope:.2g}{unit} less for each {rate} of speed that way" if limit.falls > FALLS else ""
    return f"no more than {given}{falls} ({100.0 * limit.share:.2g} % of its commands are beyond)"


def _without(robot: Robot, recordings: Sequence[Recording], told: dict[str, UnevenLimit]) -> str:
    """The command that leaves the moments beyond out; nothing where too little would be left."""
    options, out, whole = [], 0.0, 0.0
    for i, recording in enumerate(recordings):
        stretches = _merged([stretch for limit in told.values() for stretch in limit.beyond[i]])
        options += [f"--leave-out {shlex.quote(f'{recording.path}:{a:.2f}:{b:.2f}')}" for a, b in stretches]
        out += sum(b - a for a, b in stretches)
        whole += float(np.ptp(recording.command.times))
    if out > MOST_LEFT_OUT * whole or len(options) > MOST_STRETCHES:
        return ""
    bags = bag_arguments(recording.path for recording in recordings)
    output = edited_argument(robot, "unsaturated")
    return (
        f"`jointscope calibrate {robot_argument(robot)} {bags} -o {output} {' '.join(options)}` leaves these moments "
        "out, or "
    )


def _merged(stretches: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Stretches with a margin, those that nearly touch as one [s]."""
    found: list[tuple[float, float]] = []
    for a, b in sorted((a - MARGIN, b + MARGIN) for a, b in stretches):
        if found and a < found[-1][1] + NEAR:
            found[-1] = (found[-1][0], max(b, found[-1][1]))
        else:
            found.append((max(a, 0.0), b))
    return found


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
