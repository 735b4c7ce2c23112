# SPDX-License-Identifier: BSD-3-Clause
"""What is left out of the rests of a recording, and what is strange about them, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.robots.recordings.still_stretches import SHORTEST
from jointscope.robots.rests.creep import EVEN, PARTS

Array = NDArray[np.float64]
SWINGING = 12.0  # [sigma] of a link encoder that the means of parts may differ by
MANY = 0.1  # of the rests, in which links that move on steadily are no accident


def drift(recording: Recording, robot: Robot, t0: float, t1: float) -> float:
    """How far a link moves on steadily in a stretch, without what its motor turns it; 0 where all stand or swing [rad].

    Nothing but a load that changes does so.
    """
    motor, link = robot.motor_encoder, robot.link_encoder
    if link is None:
        return 0.0
    parts = []
    for encoder in (motor, link):
        stream = recording.streams[encoder.name]
        inside = stream.values[(stream.times >= t0) & (stream.times < t1)] - encoder.zero
        if len(inside) < PARTS:
            return 0.0
        parts.append(np.array([part.mean(axis=0) for part in np.array_split(inside, PARTS)]))
    steps = np.diff(parts[1] - joint_angles(robot, parts[0]), axis=0)
    mean = steps.mean(axis=0)
    steady = np.all(steps * np.sign(mean) > EVEN * np.abs(mean), axis=0) & (
        np.abs(mean) * PARTS > SWINGING * link.sigmas
    )
    return float(np.max(np.where(steady, np.abs(mean) * PARTS, 0.0)))


def notices_of(count: int, swinging: int, drifts: Array) -> tuple[Notice, ...]:
    """Of `count` rests that are left, those that were left out as links `swinging`, and links that move on steadily."""
    found, many = [], int(np.sum(drifts > 0.0))
    if swinging:
        text = f"rests: left out {swinging} of {count + swinging} in which a link still swung when the next one began"
        found.append(Notice("rests", "dropped", swinging, text))
    if many and many >= MANY * len(drifts):
        text = (
            f"rests: in {many} of {len(drifts)} a link moves on steadily, by up to {1e3 * drifts.max():.2g} mrad, "
            "while motors and /load stand: loads change that /load does not say, or links creep; check the topic"
        )
        found.append(Notice("rests", "info", many, text))
    return tuple(found)


def why_none(
    recording: Recording,
    standing: Sequence[tuple[float, float]],
    stretches: Sequence[tuple[float, float]],
    swinging: int,
) -> str:
    """The sentence for a recording without rests; stretches are those of one load within which motors stand."""
    if swinging:
        reason = (
            f"the motors stand {len(stretches)} times, and a link swings through each; hold every weight for longer"
        )
    elif standing:
        reason = f"the load changes within {SHORTEST:g} s wherever the motors stand; hold every weight for longer"
    else:
        reason = f"no motor stands for {SHORTEST:g} s; a recording of motion stands before the first option"
    return f"{recording.path}: no rests: {reason}"
