# SPDX-License-Identifier: BSD-3-Clause
"""Reads a bag as it was received: block by block, nothing sorted, nothing dropped.

`read_recording` sorts every stream by stamp and drops repeated stamps, which is right for a batch; an estimator in the
control loop has to cope with late and repeated messages, so a replay must hand them over. Only one block is in memory.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.replay.replay_result import ReplaySource
from jointscope.robots.errors import RobotError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.arrivals import Arrivals
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.bags.clocks.empty_stamps import empty_stamps
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.clocks.two_clocks import brought_together
from jointscope.tools.bags.clocks.unstamped import sent_earlier
from jointscope.tools.bags.fitting_messages import read_columns
from jointscope.tools.bags.messages.columns import Columns
from jointscope.tools.bags.messages.message_type import MessageType
from jointscope.tools.bags.messages.open_bag import Progress, RawTopic, bag_sha256, open_bag
from jointscope.tools.bags.needed_streams import (
    StreamSource,
    check_topic,
    column_order,
    in_si,
    needed_streams,
    own_messages,
    wanted_of,
)
from jointscope.tools.bags.tidying.late_copies import late_copies
from jointscope.tools.bags.tidying.second_publisher import of_second_publisher
from jointscope.tools.bags.tidying.tidy_samples import FEWEST

Array = NDArray[np.float64]

BLOCK = 20_000  # messages
ONE_SECOND = 1_000_000_000  # [ns]


class ArrivalReader:
    """The messages that a robot needs, as an iterable of blocks.

    Attributes:
        path: the bag.
        start_ns: stamp of time zero [ns]: the earliest of the first block, as `read_recording` takes it; 0 before it
            was read.
        messages: number of messages that were read.
    """

    def __init__(self, path: str | Path, robot: Robot, progress: Progress | None = None, block: int = BLOCK):
        """Opens nothing yet.

        Args:
            path: a ROS 1 .bag, a ROS 2 folder, a .db3 or an .mcap.
            robot: says which topics, fields, units and joint names.
            progress: called with the number of messages read and expected.
            block: messages per block.

        Raises:
            RobotError: joints have their stamps from another sensor.
        """
        skewed = [need.name for need in needed_streams(robot) if need.source.stamped_by]
        if skewed:
            raise RobotError(
                f"{robot.path.name}: {skewed[0]}.stamped_by: a replay feeds messages as they come and cannot wait for "
                "the stamps of another sensor; remove it for the replay"
            )
        self.path = Path(path)
        self.start_ns = self.messages = 0
        self._needed = needed_streams(robot)
        self._held = robot.command_held
        self._progress = progress
        self._block = block
        self._last: dict[str, np.ndarray] = {}
        self._left_out: Counter[tuple[str, str]] = Counter()
        self._later: dict[str, int] | None = None  # by how much stamps are moved [ns]
        self._clocks: list[Notice] = []
        self._untold: dict[str, str] = {}  # why the stamps of a stream tell nothing; empty where they do

    def __iter__(self) -> Iterator[Arrivals]:
        """Reads the bag.

        Raises:
            RecordingError: the bag cannot be read, or does not hold what the robot needs.
        """
        with open_bag(self.path) as bag:
            types = {need.name: check_topic(bag, need.source) for need in self._needed}
            topics = sorted({need.source.topic for need in self._needed})
            messages = bag.messages(topics, self._progress)
            counts = dict.fromkeys(topics, 0)
            self._last.clear()
            self._left_out.clear()
            self._untold.clear()
            self._later, self._clocks = None, []
            while block := list(islice(messages, self._block)):
                raw = {topic: RawTopic(topic) for topic in topics}
                places: dict[str, list[int]] = {topic: [] for topic in topics}
                for place, (topic, time, data) in enumerate(block):
                    raw[topic].received.append(time)
                    raw[topic].data.append(data)
                    places[topic].append(place)
                self.messages += len(block)
                yield self._arrivals(raw, places, types, counts)
                counts = {topic: counts[topic] + len(raw[topic].data) for topic in topics}

    def seconds_later(self, recording: Recording) -> float:
        """How much later time zero of these arrivals is than that of a recording of the same bag [s]."""
        return (self.start_ns - recording.start_ns) / 1e9

    def source(self, seconds: float, robot: str) -> ReplaySource:
        """What was read, with its duration [s] and the name of the robot."""
        return ReplaySource(str(self.path), bag_sha256(self.path), self.start_ns, seconds, self.messages, robot)

    def _arrivals(
        self,
        raw: dict[str, RawTopic],
        places: dict[str, list[int]],
        types: dict[str, MessageType],
        counts: dict[str, int],
    ) -> Arrivals:
        present, found, columns, about = [], [], [], []
        for need in self._needed:
            topic = raw[need.source.topic]
            fitting = self._fitting(need, topic, types, counts) if topic.data else None
            if fitting is None:
                continue
            present.append(need)
            found.append(fitting)
            before = self._last.get(need.name)
            stamps, values = _in_si(need, topic, fitting, before)
            channels = _about(need, fitting)
            self._last[need.name] = values[-1] if channels is None else _newest(values, before)
            if channels is not None and need.name == "command":
                values = _acting(stamps, values, before, self._held)
            columns.append((stamps, values))
            about.append(channels)
        if not present:
            return Arrivals.merged((), [], [])
        columns = self._on_one_clock(present, found, raw, columns)
        if not self.start_ns:
            self.start_ns = min(int(stamps.min()) for stamps, _ in columns)
        parts = [
            (
                (stamps - self.start_ns) / 1e9,
                (fitting.of(raw[need.source.topic].received_ns) - self.start_ns) / 1e9,
                values,
            )
            for need, fitting, (stamps, values) in zip(present, found, columns, strict=True)
        ]
        keys = [
            fitting.of(np.array(places[need.source.topic], dtype=float))
            for need, fitting in zip(present, found, strict=True)
        ]
        return replace(Arrivals.merged(tuple(need.name for need in present), parts, keys), about=tuple(about))

    def _on_one_clock(
        self,
        present: list[StreamSource],
        found: list[Columns],
        raw: dict[str, RawTopic],
        columns: list[tuple[np.ndarray, np.ndarray]],
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Stamps moved as the first block asks for: of two clocks, and of messages that carry none."""
        if self._later is None:
            timed = {
                need.name: TimedSamples(stamps, fitting.of(raw[need.source.topic].received_ns), values)
                for need, fitting, (stamps, values) in zip(present, found, columns, strict=True)
            }
            carry = [need.name for need, fitting in zip(present, found, strict=True) if fitting.stamps is not None]
            moved, self._clocks = brought_together({name: timed[name] for name in carry})
            stamped = dict(moved)
            for name in timed.keys() - moved.keys():
                moved[name], _ = sent_earlier(name, timed[name], stamped)
            self._later = {name: int(moved[name].stamps[0] - timed[name].stamps[0]) for name in timed}
        later = self._later
        return [(stamps + later.get(n.name, 0), values) for n, (stamps, values) in zip(present, columns, strict=True)]

    def _fitting(
        self, need: StreamSource, topic: RawTopic, types: dict[str, MessageType], counts: dict[str, int]
    ) -> Columns | None:
        """The messages of a block that fit, what does not is counted; None where a later block has none that do."""
        wanted, width = wanted_of(need)
        kind, field, first = types[need.name], need.source.field, counts[topic.name]
        own = own_messages(need, topic, kind, some=True)
        if own is not None and not len(own):
            return None
        columns = read_columns(topic.take(own), kind, field, first=first, wanted=wanted, width=width)
        if own is not None:
            columns = replace(columns, rows=columns.of(own))
        later = need.name in self._last
        if later and wanted and columns.names and not set(wanted) <= set(columns.names):
            self._left_out[need.name, "of other joints"] += len(topic.data)
            return None
        for part in columns.left_out:
            self._left_out[need.name, part.what] += part.count
        return self._own(need, topic, self._filled(need, self._on_time(need, topic, columns)))

    def _own(self, need: StreamSource, topic: RawTopic, columns: Columns) -> Columns:
        """The messages without those of a second node, which repeats the driver's later, or itself among a sensor's."""
        stamps = columns.of(topic.received_ns) if columns.stamps is None else columns.stamps
        order, foreign = np.argsort(stamps, kind="stable"), np.zeros(len(stamps), bool)
        foreign[order] = late_copies(stamps[order], columns.values[order])
        what = "of a second node that repeats those of the driver later"
        if not foreign.any() and need.name != "command" and len(order) >= FEWEST and columns.absent is None:
            foreign[order] = of_second_publisher(columns.values[order])
            what = "of a second node that publishes always the same"
        if not foreign.any():
            return columns
        self._left_out[need.name, what] += int(foreign.sum())
        return columns.take(~foreign)

    def _filled(self, need: StreamSource, columns: Columns) -> Columns:
        """The messages whose stamps are filled."""
        if columns.stamps is None or columns.stamps.max() < ONE_SECOND:
            return columns  # a simulated clock begins at zero
        zero = columns.stamps == 0
        count = int(np.count_nonzero(zero))
        if count:
            self._left_out[need.name, "whose stamp is zero"] += count
        return columns.take(~zero) if count else columns

    def _on_time(self, need: StreamSource, topic: RawTopic, columns: Columns) -> Columns:
        """The messages, without stamps where those of the first block tell nothing."""
        if columns.stamps is None:
            return columns
        if need.name not in self._untold:
            samples = TimedSamples(columns.stamps, columns.of(topic.received_ns), columns.values)
            self._untold[need.name] = empty_stamps(samples)
        return replace(columns, stamps=None) if self._untold[need.name] else columns

    def notices(self) -> list[str]:
        """What was left out because it does not fit, and whose stamps tell nothing, a sentence each."""
        left = [
            f"{name}: left out {counted(count, 'message')} {what}" for (name, what), count in self._left_out.items()
        ]
        untold = {name: why for name, why in self._untold.items() if why}
        left += [notice.text for notice in self._clocks]
        return left + [f"{name}: {why}; the time of reception stands in for it" for name, why in untold.items()]


def _in_si(
    need: StreamSource, topic: RawTopic, columns: Columns, before: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Stamps [ns] and samples in SI units of one stream, as they lie in the block; `before` is the last one's."""
    order, _ = column_order(need, columns)
    stamps = columns.of(topic.received_ns) if columns.stamps is None else columns.stamps
    return stamps, in_si(need.source, columns.values[:, order], before)


def _about(need: StreamSource, columns: Columns) -> NDArray[np.bool_] | None:
    """Which channels the messages are about, shape (n, m); None where all are about all."""
    order, _ = column_order(need, columns)
    return None if columns.absent is None else ~columns.absent[:, order]


def _newest(values: Array, before: Array | None) -> Array:
    """The last number of every channel, shape (m,); where a block has none, the one before."""
    known = np.vstack([np.full(values.shape[1], np.nan) if before is None else before, values])
    last = len(known) - 1 - np.argmax(np.isfinite(known)[::-1], axis=0)
    return np.asarray(known[last, np.arange(known.shape[1])], dtype=np.float64)


def _acting(stamps: NDArray[np.int64], values: Array, before: Array | None, held: bool) -> Array:
    """Commands of all joints where each message is about some: the others' act on, measured ones run on between."""
    whole = np.vstack([np.full(values.shape[1], np.nan) if before is None else before, values])
    for j, column in enumerate(whole.T):
        known = np.flatnonzero(np.isfinite(column))
        if not len(known):
            continue
        if held or len(known) < 2:
            last = np.searchsorted(known, np.arange(len(whole)), side="right") - 1
            whole[:, j] = np.where(last < 0, np.nan, column[known[np.maximum(last, 0)]])
            continue
        inside = known[known > 0]
        order = inside[np.argsort(stamps[inside - 1], kind="stable")]
        unknown = np.nan if known[0] > 0 else None  # before the first one of all
        whole[1:, j] = np.interp(stamps - stamps[0], stamps[order - 1] - stamps[0], column[order], left=unknown)
    return whole[1:]
