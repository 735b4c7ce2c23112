# SPDX-License-Identifier: BSD-3-Clause
"""Poses cut out of a bag: stretches in which all joints stand still and the target was seen, each as one mean.

The first moments of a rest do not count: arm and tracker settle. A rest in which a target still moves is left out, and
so is a target that is not seen in a rest. Messages with poses tell orientations, too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.pose_setup import MountedTarget
from jointscope.robots.parts.sensors import Topic
from jointscope.robots.recordings.poses import Poses, Sighting
from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.at_poses.target_rows import orientations
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.bags.fitting_messages import read_columns
from jointscope.tools.bags.messages.open_bag import Bag, bag_sha256, open_bag
from jointscope.tools.bags.needed_streams import (
    StreamSource,
    check_topic,
    column_order,
    in_si,
    own_messages,
    wanted_of,
)

Array = NDArray[np.float64]
STILL = 2e-3  # [rad/s] a joint at rest is slower, or slower than its noise
NOISES = 6.0  # times the noise of the speeds
PAUSE = 0.5  # [s] without a sample, or more, ends a rest
SHORTEST = 0.3  # [s] of a rest that is a pose
SETTLING = 0.1  # [s] at its begin
FEWEST = 3  # samples of the target
AXES = ("x", "y", "z")
BESIDE = {"position": "orientation", "translation": "rotation"}  # of a pose and of a transform
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
        tracks = [_track(bag, "poses", "positions", setup.targets[0])]
        absent = [target for target in setup.others if not bag.holds(target.positions.topic)]
        there = [target for target in setup.others if target not in absent]
        tracks += [_track(bag, f"poses.targets.{target.name}", "positions", target) for target in there]
    rests = _rests(t_q, q)
    found, moving = [], 0
    for t0, t1 in rests:
        inside = (t_q >= t0 + SETTLING) & (t_q <= t1)
        seen = [track.between(t0 + SETTLING, t1) for track in tracks]
        if np.count_nonzero(inside) < 1 or not any(np.count_nonzero(mine) >= FEWEST for mine in seen):
            continue
        if any(track.moves(mine) for track, mine in zip(tracks, seen, strict=True)):
            moving += 1
            continue
        tau = np.full(robot.n, np.nan) if effort is None else effort[inside].mean(axis=0)
        told = np.stack([track.mean(mine) for track, mine in zip(tracks, seen, strict=True)])
        found.append((q[inside].mean(axis=0), told, tau))
    if not found:
        raise RecordingError(
            f"{path}: {counted(len(rests), 'rest')} of all joints, none with a target in {setup.positions.topic}; "
            f"expected "
            "poses of half a second or more in which the tracker sees the target"
            + f"; in {moving} of them it moved by more than {1e3 * STEADY:g} mm, or its noise is that large"
            * bool(moving)
        )
    notices = []
    if moving:
        text = f"poses: left out {counted(moving, 'rest')} in which the target moved by more than {1e3 * STEADY:g} mm"
        notices.append(Notice("poses", "dropped", moving, text))
    for target in absent:
        text = f"poses: {path} has no topic {target.positions.topic}: the target {target.name} was not seen"
        notices.append(Notice("poses", "info", 0, text))
    qs, means, torques = (np.array(part) for part in zip(*found, strict=True))
    names, sightings = tuple(str(i) for i in range(len(qs))), list[Sighting]()
    for i, track in enumerate(tracks):
        if not np.any(np.isfinite(means[:, i, 0])):
            text = f"poses: {path}: the target {track.name} was seen in no rest, fewer than {FEWEST} messages in each"
            notices.append(Notice("poses", "info", 0, text))
        turned = orientations(path, means[:, i, 3:], [f"pose {name}" for name in names], track.name)
        notices += turned.notices
        sightings.append(Sighting(track.name, means[:, i, :3], turned.turns))
    return Poses(
        str(path),
        bag_sha256(path),
        names,
        qs,
        sightings[0].place,
        torque=None if effort is None else torques,
        notices=tuple(notices),
        turn=sightings[0].turn,
        others=tuple(sightings[1:]),
    )


@dataclass(frozen=True)
class _Track:
    """What a tracker tells of a target: times [s], and x, y, z [m], then the quaternion x, y, z, w where it has one."""

    name: str
    times: Array
    values: Array

    def between(self, begin: float, end: float) -> NDArray[np.bool_]:
        """Which samples are between two times."""
        return np.asarray((self.times >= begin) & (self.times <= end))

    def moves(self, mine: NDArray[np.bool_]) -> bool:
        """Whether the target was seen, and did not stand still."""
        return bool(np.count_nonzero(mine) >= FEWEST and np.ptp(self.values[mine, :3], axis=0).max() > STEADY)

    def mean(self, mine: NDArray[np.bool_]) -> Array:
        """Of some samples, shape (7,); not a number where the target was not seen, or has no orientation."""
        found = np.full(7, np.nan)
        if np.count_nonzero(mine) >= FEWEST:
            found[:3] = self.values[mine, :3].mean(axis=0)
            xyzw = self.values[mine, 3:]
            if xyzw.shape[1]:
                mean = (xyzw * np.sign(xyzw @ xyzw[0] + 1e-300)[:, None]).mean(axis=0)  # q and -q are one orientation
                found[3:] = mean
        return found


def _track(bag: Bag, section: str, key: str, target: MountedTarget) -> _Track:
    """The positions of a target, and its orientations where the messages have them beside the positions."""
    source = target.positions
    times, places, _ = _signal(bag, StreamSource(key, source, AXES, of_target=True, section=section))
    head, _, last = source.field.rpartition(".")
    turn = BESIDE.get(last) if head else None
    if turn is None:
        return _Track(target.name, times, places)
    need = replace(source, field=f"{head}.{turn}", unit="rad")  # a quaternion has no unit: by a factor of one
    beside, xyzw, _ = _signal(bag, StreamSource(key, need, (*AXES, "w"), of_target=True, section=section))
    if len(beside) != len(times):
        return _Track(target.name, times, places)
    return _Track(target.name, times, np.hstack([places, xyzw]))


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
    raw = raw.take(own_messages(need, raw, kind))
    columns = read_columns(raw, kind, need.source.field, wanted=wanted_of(need)[0])
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
