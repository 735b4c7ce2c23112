# SPDX-License-Identifier: BSD-3-Clause
"""Angles in degrees where radians are expected, and millimetres for metres: told before any equilibrium is looked for.

The limits of the URDF tell, and motors and links tell of each other: no spring makes one move many times as far.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Encoder
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.units import si_factor, si_unit

Array = NDArray[np.float64]

ANY_TURN = 4.0 * np.pi  # [rad] that a joint without limits may be turned by
OUTLYING = 0.005  # share of the samples on either side that does not count
TOO_FAR = 3.0  # times what the URDF allows
APART = 20.0  # times that a motor may move as far as its link, or the other way round
MOVES = 100.0  # sigmas from which a joint is said to move
OTHERS = ("rad", "deg", "m", "mm")


def check_angle_units(recording: Recording, robot: Robot, coupled: bool = True) -> None:
    """Refuses positions in another unit than the robot file says.

    Args:
        recording: of rests, or with locked springs.
        robot: with its limits.
        coupled: whether the file says how far motors turn their links; without it links alone are judged.

    Raises:
        RecordingError: positions are far beyond what the URDF allows, or those of motors and links are in two units.
    """
    motor, link = robot.motor_encoder, robot.link_encoder
    spans = {motor.name: _span(joint_angles(robot, recording.streams[motor.name].values))}
    if link is not None:
        spans[link.name] = _span(recording.streams[link.name].values)
    limits = robot.tree.limits
    allowed = limits[:, 1] - limits[:, 0]
    allowed = np.where(np.isfinite(allowed) & (allowed > 0.0), allowed, ANY_TURN)
    slides = np.array([joint in robot.tree.slides for joint in robot.joints])
    allowed = np.where(slides & ~np.isfinite(limits).all(axis=1), np.inf, allowed)
    # links first: a motor may be off by its transmission
    for encoder in [each for each in (link, motor if coupled else None) if each is not None]:
        share = spans[encoder.name] / allowed
        j = int(np.argmax(share))
        if share[j] > TOO_FAR:
            unit = robot.unit_at(robot.joints[j], "rad")
            raise RecordingError(
                f"{recording.path}: {encoder.channels[j]} spans {spans[encoder.name][j]:.4g} {unit}; "
                f"{robot.tree.urdf.name} allows {allowed[j]:.4g} {unit}; {_hint(robot, encoder, j, float(share[j]))}"
            )
    if link is not None and coupled:
        _check_ratio(recording, robot, motor, link, spans)


def _check_ratio(recording: Recording, robot: Robot, motor: Encoder, link: Encoder, spans: dict[str, Array]) -> None:
    moved = np.maximum(spans[motor.name], spans[link.name]) > MOVES * np.maximum(motor.sigmas, link.sigmas)
    for few, many in ((motor, link), (link, motor)):
        times = np.where(moved, spans[many.name] / np.maximum(spans[few.name], 1e-12), 0.0)
        j = int(np.argmax(times))
        known = spans[few.name][j] > MOVES * float(few.sigmas[j])
        if known and times[j] > APART:
            raise RecordingError(
                f"{recording.path}: {many.channels[j]} moves {times[j]:.3g} times as far as {few.channels[j]}, both as "
                f"joint angles; {_hint(robot, many, j, float(times[j]))}"
            )


def _span(values: Array) -> Array:
    low, high = np.quantile(values, [OUTLYING, 1.0 - OUTLYING], axis=0)
    return np.asarray(high - low)


def _hint(robot: Robot, encoder: Encoder, joint: int, excess: float) -> str:
    """Which unit would bring the positions of a joint back."""
    now = encoder.source.bag_units(robot.n)[joint]
    place = f"`unit` of sensors.{encoder.name} in the robot file (now {now})"
    for unit in OTHERS:
        if si_unit(unit) == si_unit(now) and excess * si_factor(unit) / si_factor(now) <= TOO_FAR and unit != now:
            word = {"deg": "degrees", "rad": "radians", "mm": "millimetres", "m": "metres"}[unit]
            return f"the {'angles' if si_unit(now) == 'rad' else 'positions'} look like {word}: set {place} to {unit}"
    return f"check {place}"
