# SPDX-License-Identifier: BSD-3-Clause
"""The gain of a position controller from a recording of goals, readings and what the controller made of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.position_controller import PositionController
from jointscope.robots.recordings.recording import Recording

OFF_LIMIT = 0.95  # of the limit: commands beyond it say nothing about the gain
FEWEST = 50  # commands of each joint that must


def controller_of(robot: Robot, recording: Recording) -> PositionController | None:
    """The robot's controller with the gain of a recording, by least squares where the robot file says `measured`.

    Raises:
        RecordingError: it cannot be measured: no goals, too few commands off the limit, or commands away from the goal.
    """
    controller, goal, command = robot.controller, recording.goal, recording.command
    if controller is None or controller.gain is not None:
        return controller
    if goal is None:
        raise RecordingError(
            f"{recording.path} holds no goal positions on {controller.source.topic}; check topic and field of "
            "`controller` in the robot file, or take that section out"
        )
    reading = recording.streams[robot.motor_encoder.name]
    held = np.clip(np.searchsorted(goal.times, command.times, side="right") - 1, 0, len(goal) - 1)
    gains = []
    for j, joint in enumerate(robot.joints):
        away = goal.values[held, j] - np.interp(command.times, reading.times, reading.values[:, j])
        known = np.isfinite(away) & (np.abs(command.values[:, j]) < OFF_LIMIT * controller.limit)
        square = float(np.sum(away[known] ** 2))
        gain = float(np.sum(command.values[known, j] * away[known])) / square if square > 0.0 else 0.0
        if np.count_nonzero(known) < FEWEST or gain <= 0.0:
            raise RecordingError(
                f"{recording.path}: the gain of {joint}'s controller cannot be measured: "
                f"{np.count_nonzero(known)} commands below the limit, gain {gain:.3g}; expected at least {FEWEST} and "
                "a positive gain: set controller.gain in the robot file"
            )
        gains.append(gain)
    return replace(controller, gain=tuple(gains))
