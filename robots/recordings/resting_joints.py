# SPDX-License-Identifier: BSD-3-Clause
"""Joints that stand still, what therefore cannot be found, and the two ways out; every verb says the same."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.command_words import init_command
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

MOVED_SIGMAS = 20.0  # an encoder that spans less than this many sigmas shows noise, not motion
MOVED_ANGLE = 1e-3  # [rad]


def joints_without_motion(recording: Recording, robot: Robot) -> tuple[str, ...]:
    """Joints whose motor encoder shows nothing but noise."""
    encoder = robot.motor_encoder
    span = np.ptp(recording.streams[encoder.name].values, axis=0)
    moved = span > np.maximum(MOVED_ANGLE, MOVED_SIGMAS * encoder.sigmas)
    return tuple(joint for joint, yes in zip(robot.joints, moved, strict=True) if not yes)


def own_parameters(robot: Robot, joints: Sequence[str]) -> list[str]:
    """Names of the parameters of these joints that a calibration would find."""
    owners = tuple(f"{joint}." for joint in joints)
    return [name for name, p in robot.parameters.items() if name.startswith(owners) and not p.fixed]


def what_it_cannot_tell(robot: Robot, resting: Sequence[str]) -> str:
    """One sentence about joints that do not move in a recording."""
    verb = "does" if len(resting) == 1 else "do"
    lost = ", ".join(own_parameters(robot, resting)) or "anything about them"
    return f"{', '.join(resting)} {verb} not move in this recording, so it cannot tell {lost}"


def must_move(robot: Robot, recordings: Sequence[Recording]) -> None:
    """Every joint whose parameters are to be found moves in at least one recording.

    Raises:
        RecordingError: some never do; the message says how to go on.
    """
    resting = [joint for joint in robot.joints if all(joint in joints_without_motion(r, robot) for r in recordings)]
    resting = [joint for joint in resting if own_parameters(robot, [joint])]
    if not resting:
        return
    paths = ", ".join(recording.path for recording in recordings)
    verb = "moves" if len(resting) == 1 else "move"
    raise RecordingError(
        f"{paths}: {', '.join(resting)} never {verb}, so {', '.join(own_parameters(robot, resting))} cannot be found; "
        f"add a recording that moves {', '.join(resting)} to this one, or lock {_locked(robot, recordings[0], resting)}"
    )


def _locked(robot: Robot, recording: Recording, resting: Sequence[str]) -> str:
    """How to take joints out of the model where they stand."""
    encoder = robot.motor_encoder
    at = np.median(recording.streams[encoder.name].values, axis=0) - encoder.zero
    places = ", ".join(f"{joint}: {at[robot.joints.index(joint)]:.6g}" for joint in resting)
    moving = [joint for joint in robot.joints if joint not in resting]
    command = init_command(robot, recording.path, "locked", joints=moving)
    return f"it where it stands, `locked: {{{places}}}` and out of `joints`: {command}"
