# SPDX-License-Identifier: BSD-3-Clause
"""Knots of springs' curves where the springs were deflected, as the encoders of motors and links say.

A law with knots has meaning over the range that was seen, and where its knots lie within it is a choice, not a value to
estimate: they are placed once, before a calibration begins, and held. A file that holds them keeps its own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.rests.rests import Rests

Array = NDArray[np.float64]
Pair = tuple[Array, Array]  # positions of motors and links, zeros of their encoders taken off, shape (m, n) each
LEAST = 0.1  # share of the larger side that each side of a range has at least


def with_knots(robot: Robot, recordings: Iterable[Recording | Rests]) -> Robot:
    """The robot with the knots that its file does not hold where springs were deflected, and held.

    Without encoders on the links nothing is known of deflections: knots stay where the file has them.

    Args:
        robot: with start values.
        recordings: of motion, or rests.
    """
    wanted = [
        (here.owner, p.of_range, here.parameter(p.name))
        for here in robot.effects
        for p in here.effect.parameters
        if p.held and p.of_range and not robot.parameters[here.parameter(p.name)].fixed
    ]
    if not wanted:
        return robot
    pairs = [pair for pair in (_pair(robot, recording) for recording in recordings) if pair is not None]
    seen = deflections_of(robot, [_seen(robot, *pair) for pair in pairs]) if pairs else {}
    parameters = dict(robot.parameters)
    for owner, side, name in wanted:
        value = seen.get(owner, {}).get(side, parameters[name].value)
        parameters[name] = replace(parameters[name], value=value, prior=value, fixed=True)
    return replace(robot, parameters=parameters)


def deflections_of(robot: Robot, seen: Iterable[Array]) -> dict[str, dict[str, float]]:
    """How far the spring of each elastic joint was deflected, "forward" and "backward" [rad], by joint.

    Args:
        robot: whose layout the states have.
        seen: states as springs see them, shape (m, d) each.
    """
    layout, found = robot.layout, dict[str, dict[str, float]]()
    parts = [x[:, layout.joint_q] - x[:, layout.motor_q] for x in seen]
    for j in layout.elastic_joints:
        forward, backward = (max(float(np.max(side * part[:, j])) for part in parts) for side in (1.0, -1.0))
        least = max(LEAST * max(forward, backward), 1e-9)
        found[robot.joints[j]] = {"forward": max(forward, least), "backward": max(backward, least)}
    return found


def _pair(robot: Robot, recording: Recording | Rests) -> Pair | None:
    """What encoders read at the same times but in stretches left out, zeros taken off; None without link encoders."""
    if isinstance(recording, Rests):
        return None if recording.q_link is None else (recording.q_motor, recording.q_link)
    if robot.link_encoder is None:
        return None
    motor, link = (recording.streams[sensor.name] for sensor in (robot.motor_encoder, robot.link_encoder))
    inside = (motor.times >= link.times[0]) & (motor.times <= link.times[-1]) & recording.are_judged(motor.times)
    if not np.any(inside):
        return None
    times = motor.times[inside]
    q_link = np.column_stack([np.interp(times, link.times, column) for column in link.values.T])
    return motor.values[inside] - robot.motor_encoder.zero, q_link - robot.link_encoder.zero


def _seen(robot: Robot, q_motor: Array, q_link: Array) -> Array:
    """States as springs see them, shape (m, d)."""
    layout, x = robot.layout, np.zeros((len(q_motor), robot.layout.size))
    for j in layout.elastic_joints:
        x[:, layout.motor_q[j]] = q_motor[:, j]
    x[:, layout.joint_q] = q_link
    return np.asarray(ElasticJoints(robot).seen(x, robot.values))
