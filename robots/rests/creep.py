# SPDX-License-Identifier: BSD-3-Clause
"""Motors that creep: they slide on so slowly that everything upon them is at rest, and their friction is at its limit.

A controller that holds a weight slowly pushes a motor over its dry friction. Nothing accelerates then, damping is a
small part of the friction, and its direction is known: such a stretch tells more than one in which the motor stands
somewhere within its band.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.robots.recordings.still_stretches import SHORTEST, WITHIN

Array = NDArray[np.float64]
Stretches = Sequence[tuple[float, float]]
BLOCK = 0.125  # [s] over which positions are averaged for a velocity
DAMPED = 0.05  # of dry friction that damping may be
FAST = 200.0  # [sigma of the encoder per second] at the most
EVEN = 0.25  # of the mean step from part to part that each must have at least, where a motor creeps all the time
PARTS = 4  # of a stretch


def creeping_stretches(recording: Recording, robot: Robot, others: Stretches) -> list[tuple[float, float]]:
    """Stretches in which every motor stands or creeps, without others [s].

    None where springs stand between motors and what no encoder sees: links may swing there.

    Args:
        recording: of the robot.
        robot: its dry friction and damping tell what creep is.
        others: stretches that are left out [s].
    """
    if robot.layout.motors and robot.link_encoder is None:
        return []
    stream = recording.streams[robot.motor_encoder.name]
    times = stream.times
    edges = np.arange(times[0], times[-1] + BLOCK, BLOCK)
    block = np.searchsorted(edges, times, side="right") - 1
    counts = np.bincount(block, minlength=len(edges))
    sums = np.column_stack([np.bincount(block, column, minlength=len(edges)) for column in stream.values.T])
    steps = np.abs(np.diff(sums / np.maximum(counts, 1)[:, None], axis=0))
    slow = np.all(steps < fastest_creep(robot) * BLOCK, axis=1) & (counts[1:] > 0) & (counts[:-1] > 0)
    turns = np.flatnonzero(np.diff(np.concatenate([[False], slow, [False]])))
    found = [
        part
        for first, last in zip(turns[::2].tolist(), turns[1::2].tolist(), strict=True)
        for part in _without(float(edges[first]), float(min(edges[last] + BLOCK, times[-1])), others)
    ]
    return [(t0, t1) for t0, t1 in found if t1 - t0 >= SHORTEST]


def fastest_creep(robot: Robot) -> Array:
    """Velocity of each motor up to which it creeps, shape (n,) [rad/s]."""
    found = FAST * robot.motor_encoder.sigmas
    for j, joint in enumerate(robot.joints):
        damping = robot.drive_parameter(joint, "k_mi").value if "k_mi" in robot.drive_laws else 0.0
        if robot.has_effect("motor_viscous", joint):
            damping += robot.parameter(f"{joint}.motor_viscous.coefficient").value
        if damping > 0.0:
            found[j] = min(found[j], DAMPED * robot.drive_parameter(joint, "coulomb_torque").value / damping)
    return found


def creep_of(stream: Stream, sigmas: Array, t0: float, t1: float) -> tuple[Array, NDArray[np.bool_]]:
    """Velocity of each motor in a stretch, shape (n,) [rad/s], and whose friction is known, shape (n,).

    A motor stands (0) or creeps all the time; the friction of one that moved and stopped is anywhere.

    Args:
        stream: of the motors' encoders.
        sigmas: of these, shape (n,) [rad].
        t0: where the stretch begins [s].
        t1: where it ends [s].
    """
    values = stream.values[(stream.times >= t0) & (stream.times < t1)]
    if len(values) < PARTS:
        return np.zeros(len(sigmas)), np.ones(len(sigmas), dtype=bool)
    stands = np.ptp(values, axis=0) <= WITHIN * sigmas
    steps = np.diff([part.mean(axis=0) for part in np.array_split(values, PARTS)], axis=0)
    mean = steps.mean(axis=0)
    creeps = ~stands & np.all(steps * np.sign(mean) > EVEN * np.abs(mean), axis=0)
    return np.where(creeps, mean * PARTS / (t1 - t0), 0.0), stands | creeps


def _without(t0: float, t1: float, others: Stretches) -> Iterator[tuple[float, float]]:
    """What is left of a stretch without others, which stand in their order."""
    for a, b in others:
        if b <= t0 or a >= t1:
            continue
        if a > t0:
            yield t0, a
        t0 = b
    if t1 > t0:
        yield t0, t1
