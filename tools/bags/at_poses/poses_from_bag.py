# SPDX-License-Identifier: BSD-3-Clause
"""Poses cut out of a bag: stretches in which all joints stand still and the target was seen, each as one mean.

The first moments of a rest do not count: arm and tracker settle. A rest in which the target still moves is left out.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Topic
from jointscope.robots.recordings.poses import Poses
from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.bags.fitting_messages import read_columns
from jointscope.tools.bags.messages.open_bag import Bag, bag_sha256, open_bag
from jointscope.tools.bags.needed_streams import StreamSource, check_topic, column_order, in_si

Array = NDArray[np.float64]
STILL = 2e-3  # [rad/s] a joint at rest is slower, or slower than its noise
NOISES = 6.0  # times the noise of the speeds
PAUSE = 0.5  # [s] without a sample, or more, ends a rest
SHORTEST = 0.3  # [s] of a rest that is a pose
SETTLING = 0.1  # [s] at its begin
FEWEST = 3  # samples of the target
STEADY = 1e-3  # [m] that the target may move in a rest


def poses_from_bag(path: Path, robot: Robot) -> Poses:
    """The poses of a bag.

    Raises:
        RecordingError: a topic is missing, or no rest has a target.
    """
    setup = robot.poses
    assert setup is not None
    with open_bag(path) as bag:
        t_q, q, effort = _joints(bag, setup.joint_states, robot)
        t_x, target, _ = _signal(bag, StreamSource("target", setup.positions, ("x", "y", "z")))
    rests = _rests(t_q, q)
    found, moving = [], 0
    for t0, t1 in rests:
        inside = (t_q >= t0 + SETTLING) & (t_q <= t1)
        seen = (t_x >= t0 + SETTLING) & (t_x <= t1)
        if np.count_nonzero(inside) < 1 or np.count_nonzero(seen) < FEWEST:
            continue
        if np.ptp(target[seen], axis=0).max() > STEADY:
            moving += 1
            continue
        tau = np.full(robot.n, np.nan) if effort is None else effort[inside].mean(axis=0)
        found.append((q[inside].mean(axis=0), target[seen].mean(axis=0), tau))
    if not found:
        raise RecordingError(
            f"{path}: {counted(len(rests), 'rest')} of all joints, none with a target in {setup.positions.topic}; "
            f"expected "
            "poses of half a second or more in which the tracker sees the target"
        )
    notices = []
    if moving:
        text = f"poses: left out {counted(moving, 'rest')} in which the target moved by more than {1e3 * STEADY:g} mm"
        notices.append(Notice("poses", "dropped", moving, text))
    qs, targets, torques = (np.array(part) for part in zip(*found, strict=True))
    names = tuple(str(i) for i in range(len(qs)))
    return Poses(
        str(path),
        bag_sha256(path),
        names,
        qs,
        targets,
        torque=None if effort is None else torques,
        notices=tuple(notices),
    )


def _joints(bag: Bag, source: Topic, robot: Robot) -> tuple[Array, Array, Array | None]:
    """Times, positions of the robot's joints, and their efforts where the messages have them."""
    channels = tuple(f"{joint}.motor_position" for joint in robot.joints)
    times, q, order = _signal(bag, StreamSource("joint_states", source, channels))
    if source.field != "position":
        return times, q, None
    raw = bag.read([source.topic])[source.topic]
    try:
        efforts = read_columns(raw, bag.message_type(source.topic), "effort")
    except RecordingError:
        return times, q, None
    if len(efforts.values) != len(q) or efforts.values.shape[1] <= int(order.max()):
        return times, q, None
    return times, q, efforts.values[:, order]


def _signal(bag: Bag, need: StreamSource) -> tuple[Array, Array, NDArray[np.intp]]:
    """Times [s], values in SI units, and the places of the channels in the messages."""
    kind = check_topic(bag, need.source)
    raw = bag.read([need.source.topic])[need.source.topic]
    columns = read_columns(raw, kind, need.source.field, wanted=need.source.names)
    order, _ = column_order(need, columns)
    stamps = columns.of(raw.received_ns) if columns.stamps is None else columns.stamps
    values = in_si(need.source, columns.values[:, order])
    rows = np.argsort(stamps, kind="stable")
    return stamps[rows] / 1e9, values[rows], order


def _rests(times: Array, q: Array) -> list[tuple[float, float]]:
    """Stretches in which every joint stands [s]."""
    if len(times) < 2:
        return []
    steps = np.maximum(np.diff(times), 1e-6)
    speeds = np.abs(np.diff(q, axis=0)) / steps[:, None]
    noise = np.median(speeds, axis=0)
    still = np.all(speeds < np.maximum(STILL, NOISES * np.minimum(noise, STILL)), axis=1) & (steps < PAUSE)
    edges = np.flatnonzero(np.diff(still.astype(np.int8), prepend=0, append=0)).reshape(-1, 2)
    found = [(float(times[a]), float(times[b])) for a, b in edges]
    return [(a, b) for a, b in found if b - a >= SHORTEST]
