# SPDX-License-Identifier: BSD-3-Clause
"""Reads what a robot needs from a bag: the command and every sensor, in SI units, each at its own times."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.starts.end_stops import EndStop, end_stops
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.sections.locked_section import names_recording, no_motion_text
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import LinkEncoder, MotorEncoder
from jointscope.robots.recordings.recording import Notice, Recording, Stream
from jointscope.robots.recordings.wrapped_counter import continued
from jointscope.robots.units import joined
from jointscope.tools.bags.clocks.one_time_axis import on_one_time_axis
from jointscope.tools.bags.clocks.own_stamps import at_message_stamps
from jointscope.tools.bags.clocks.time_order import in_time_order
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.fitting_messages import fitting_messages, left_out_notices
from jointscope.tools.bags.held_posture import held_posture
from jointscope.tools.bags.messages.columns import Columns
from jointscope.tools.bags.messages.message_parts import message_parts
from jointscope.tools.bags.messages.message_type import MessageType
from jointscope.tools.bags.messages.open_bag import Bag, Progress, RawTopic, bag_sha256, open_bag
from jointscope.tools.bags.mimic_positions import mimic_notices
from jointscope.tools.bags.needed_streams import (
    StreamSource,
    check_topic,
    column_order,
    in_si,
    needed_streams,
    own_messages,
    wanted_of,
)
from jointscope.tools.bags.silences import with_silences_left_out
from jointscope.tools.bags.tidying.late_copies import without_late_copies
from jointscope.tools.bags.tidying.lone_samples import without_lone_samples
from jointscope.tools.bags.tidying.long_holes import with_short_holes
from jointscope.tools.bags.tidying.lost_targets import without_lost
from jointscope.tools.bags.tidying.not_finite import without_gibberish
from jointscope.tools.bags.tidying.stream_notices import (
    by_importance,
    clipping_notices,
    said_once,
    step_notices,
    timing_notices,
)
from jointscope.tools.bags.tidying.tidy_samples import cleaned_sensor

SHARED = 0.5  # of the rows of a stream that lack a channel, from which several drivers make it
LISTED = 3  # contacts that are named by their times


def read_recording(
    path: str | Path,
    robot: Robot,
    progress: Progress | None = None,
    decode_all: bool = False,
    locked_springs: bool = False,
) -> Recording:
    """Reads a bag.

    Args:
        path: a ROS 1 .bag, a ROS 2 folder, a .db3 or an .mcap.
        robot: says which topics, fields, units and joint names.
        progress: called with the number of messages read and expected.
        decode_all: decode every message in full, as a reference for the fast path; the result is the same.
        locked_springs: whether the recording is wanted for springs being locked in it.

    Returns:
        The streams, with notices of what was dropped or looked odd.

    Raises:
        RecordingError: the bag cannot be read, or does not hold what the robot needs.
    """
    if not locked_springs and names_recording(robot, path):
        raise RecordingError(no_motion_text(robot, path))
    needed = needed_streams(robot)
    with open_bag(path) as bag:
        types = {need.name: check_topic(bag, need.source) for need in needed}
        wanted = {need.source.topic for need in needed}
        if robot.controller is not None and robot.controller.source.topic in bag.topics:
            wanted.add(robot.controller.source.topic)
        topics = bag.read(sorted(wanted), progress)
        notices = [notice for need in needed for notice in _surplus(need.name, topics[need.source.topic], bag)]
        goal, found = _goal(bag, robot, topics, decode_all)
        notices += found
    raw = {need.name: _own(need, topics[need.source.topic], types[need.name]) for need in needed}
    parts = {n.name: message_parts(raw[n.name], types[n.name], n.source.field, decode_all) for n in needed}
    posture, found = held_posture([parts[name] for name in _encoders(robot)], robot, str(path))
    notices += found + mimic_notices([parts[name] for name in _encoders(robot)], robot)
    columns = {n.name: fitting_messages(parts[n.name], *wanted_of(n)) for n in needed}
    samples, found = _in_bag_order(needed, raw, types, columns, {*posture, *robot.tree.model.names})
    notices += said_once(found)
    samples, seams, found = on_one_time_axis(samples, [name for name in samples if columns[name].stamps is not None])
    notices += found
    for need in needed:
        samples[need.name], found = _cleaned(need, samples[need.name], robot.command_held)
        notices += found
    samples, found = without_lone_samples(samples)
    notices += found
    start_ns = min(int(s.stamps[0]) for s in samples.values())
    streams = {need.name: _stream(need, samples[need.name], start_ns) for need in needed}
    for stream in streams.values():
        notices += timing_notices(stream.name, _times_of_one_clock(stream))
        notices += clipping_notices(stream.name, stream.measured, stream.channels, stream.unit)
    notices += step_notices("command", streams["command"].values, streams["command"].channels, streams["command"].unit)
    moving_goal = None if goal is None else _stream(goal[0], goal[1], start_ns)
    recording = Recording(str(path), bag_sha256(path), start_ns, streams, notices, moving_goal, posture=posture)
    if seams := [(a, b) for a, b in seams if b > start_ns]:
        recording = recording.leaving_out([((a - start_ns) / 1e9, (b - start_ns) / 1e9) for a, b in seams])
    recording = with_silences_left_out(with_short_holes(recording), robot.motor_encoder.name)
    recording = with_end_stops_left_out(recording, robot)
    return replace(recording, notices=by_importance(recording.notices))


def read_posture(path: str | Path, robot: Robot) -> tuple[dict[str, float], list[Notice]]:
    """Where a bag has the joints that the robot does not model [rad or m], and what is said about them.

    Raises:
        RecordingError: the bag cannot be read, or one of them moves.
    """
    if not robot.tree.other_joints:
        return {}, []
    needed = [need for need in needed_streams(robot) if need.name in _encoders(robot)]
    with open_bag(path) as bag:
        types = {need.name: check_topic(bag, need.source) for need in needed}
        raw = bag.read(sorted({need.source.topic for need in needed}))
    parts = [message_parts(raw[need.source.topic], types[need.name], need.source.field) for need in needed]
    return held_posture(parts, robot, str(path))


def _encoders(robot: Robot) -> list[str]:
    """Sensors whose messages may name joints that the robot does not model."""
    return [name for name, sensor in robot.sensors.items() if isinstance(sensor, MotorEncoder | LinkEncoder)]


def _own(need: StreamSource, topic: RawTopic, message_type: MessageType) -> RawTopic:
    return topic.take(own_messages(need, topic, message_type))


def _in_bag_order(
    needed: Sequence[StreamSource],
    raw: Mapping[str, RawTopic],
    types: Mapping[str, MessageType],
    columns: Mapping[str, Columns],
    known: Container[str],
) -> tuple[dict[str, TimedSamples], list[Notice]]:
    """The channels of every stream, in the order of the bag and the unit of the bag."""
    samples, notices = dict[str, TimedSamples](), list[Notice]()
    stamps = {name: found.stamps for name, found in columns.items()}
    for need in needed:
        topic, message_type = raw[need.name], types[need.name]
        samples[need.name], found = _samples(need, topic, message_type, columns[need.name], stamps, known=known)
        notices += found
    return samples, notices


def _cleaned(need: StreamSource, samples: TimedSamples, held: bool) -> tuple[TimedSamples, list[Notice]]:
    """The samples of one stream in the order of their stamps and in SI units, without those that are none."""
    samples, notices = in_time_order(need.name, samples)
    samples, found = without_late_copies(need.name, samples)
    notices += found
    samples, found = without_gibberish(need.name, need.channels, samples, need.source.wraps, held)
    notices += found
    if need.of_target:
        samples, found = without_lost(need.name, samples)
        notices += found
    if need.name != "command":  # commands jump and repeat themselves as they like
        samples, found = cleaned_sensor(need.name, need.channels, samples, need.source.wraps)
        notices += found
    return replace(samples, values=in_si(need.source, samples.values)), notices


def _goal(
    bag: Bag, robot: Robot, raw: dict[str, RawTopic], decode_all: bool
) -> tuple[tuple[StreamSource, TimedSamples] | None, list[Notice]]:
    """Goal positions, if the robot has a controller and the bag holds them; a model can do without."""
    if robot.controller is None:
        return None, []
    need = StreamSource("goal", robot.controller.source, tuple(f"{joint}.goal" for joint in robot.joints))
    try:
        message_type = check_topic(bag, need.source)
        topic = raw[need.source.topic]
        parts = message_parts(topic, message_type, need.source.field, decode_all)
        samples, notices = _samples(need, topic, message_type, fitting_messages(parts, *wanted_of(need)), {})
        samples, found = in_time_order(need.name, samples)
        samples = replace(samples, values=in_si(need.source, samples.values))
    except RecordingError as err:
        return None, [Notice("goal", "info", 0, f"goal: {err}; the controller cannot be simulated")]
    return (need, samples), notices + found


def _samples(
    need: StreamSource,
    topic: RawTopic,
    message_type: MessageType,
    columns: Columns,
    others: Mapping[str, NDArray[np.int64] | None],
    known: Container[str] = (),
) -> tuple[TimedSamples, list[Notice]]:
    """The channels of one stream in the order of the bag; `others` has the stamps of all sensors."""
    order, notices = column_order(need, columns, known)
    notices += left_out_notices(need.name, columns)
    received, stamps = columns.of(topic.received_ns), columns.stamps
    values = columns.values[:, order]
    if stamps is None:
        stamps = received
    if need.source.stamped_by:
        whole = continued(values, need.source.wraps) if need.source.wraps else values
        values, found = at_message_stamps(need.name, need.source.stamped_by, stamps, whole, others)
        notices += found
    absent = None if columns.absent is None else columns.absent[:, order]
    return TimedSamples(stamps, received, values, absent), notices


def _times_of_one_clock(stream: Stream) -> NDArray[np.float64]:
    """Times of the channel with most samples: those of several drivers together are none of any clock."""
    if stream.filled is None or stream.filled.any(axis=1).mean() < SHARED:
        return stream.times
    return stream.channel(int(np.argmin(stream.filled.sum(axis=0)))).times


def _surplus(name: str, topic: RawTopic, bag: Bag) -> list[Notice]:
    more = len(topic.data) - bag.count(topic.name)
    text = f"{name}: {more} messages more than the bag's index promises; all are used"
    return [Notice(name, "info", more, text)] if more > 0 else []


def _stream(need: StreamSource, samples: TimedSamples, start_ns: int) -> Stream:
    """Floats begin here: stamps stay integers until the start is subtracted."""
    return Stream(
        name=need.name,
        times=(samples.stamps - start_ns) / 1e9,
        values=samples.values,
        channels=need.channels,
        unit=joined(need.source.si_units(len(need.channels))),
        received=(samples.received - start_ns) / 1e9,
        filled=samples.filled,
    )


def with_end_stops_left_out(recording: Recording, robot: Robot) -> Recording:
    """The recording without the contacts, and with a notice of each stop.

    Raises:
        RecordingError: hardly anything would be left.
    """
    stops = end_stops(robot, recording)
    if not stops:
        return recording
    said = [_sentence(stop, robot) for stop in stops]
    try:
        without = recording.leaving_out([stretch for stop in stops for stretch in stop.stretches])
    except RecordingError as err:
        raise RecordingError(f"{'; '.join(said)}. {err}") from err
    notices = [
        Notice(robot.motor_encoder.name, "end_stop", len(stop.stretches), f"{text}; left out there")
        for stop, text in zip(stops, said, strict=True)
    ]
    return replace(without, notices=[*without.notices, *notices])


def _sentence(stop: EndStop, robot: Robot) -> str:
    length, torque = (robot.unit_at(stop.joint, unit) for unit in ("rad", "N m"))
    times = ", ".join(f"{t0:.2f} to {t1:.2f}" for t0, t1 in stop.stretches[:LISTED])
    more = len(stop.stretches) - LISTED
    total = sum(t1 - t0 for t0, t1 in stop.stretches)
    return (
        f"{stop.joint} presses with up to {stop.torque:.2g} {torque} against something at {stop.at:.4g} {length}, the "
        f"end of its motion, as against an end stop ({times} s{f' and {more} times more' if more > 0 else ''}; "
        f"{total:.2g} s in all)"
    )
