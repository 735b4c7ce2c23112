# SPDX-License-Identifier: BSD-3-Clause
"""Does an accelerometer feel gravity? Its unit shows there, and whether the IMU has one at all."""

from __future__ import annotations

import numpy as np

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.robots.units import UNITS, si_factor, si_unit

SAME = 1.5  # a median size within this factor of gravity's is gravity with motion upon it


def check_accelerometers(recording: Recording, robot: Robot) -> list[Notice]:
    """Checks all accelerometers.

    Returns:
        Notices about sizes that no unit explains.

    Raises:
        RecordingError: an IMU without an accelerometer, or values in another unit than the robot file says.
    """
    notices = []
    for sensor in robot.accelerometers:
        values, expected = recording.streams[sensor.name].values, float(np.linalg.norm(robot.gravity_at(sensor)))
        if not np.any(values):
            raise RecordingError(
                f"{sensor.name} reads zero in all {len(values)} samples: the IMU on {sensor.source.topic} has no "
                f"accelerometer; remove sensors.{sensor.name} and its lever from the robot file"
            )
        seen, now = float(np.median(np.linalg.norm(values, axis=1))), sensor.source.unit
        if expected == 0.0 or 1.0 / SAME < seen / expected < SAME:
            continue
        text = f"{sensor.name} feels {seen:.3g} m/s^2, expected about {expected:.3g} of gravity"
        for unit in UNITS:
            ratio = seen * si_factor(unit) / (si_factor(now) * expected)
            if si_unit(unit) == si_unit(now) and 1.0 / SAME < ratio < SAME:
                raise RecordingError(
                    f"{text}; its values look like {unit}: set `unit` of sensors.{sensor.name} in the robot file "
                    f"(now {now}) to {unit}"
                )
        notices.append(Notice(sensor.name, "unit", 0, f"{text}; check its unit and its topic"))
    return notices
