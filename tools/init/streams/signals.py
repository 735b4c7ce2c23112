# SPDX-License-Identifier: BSD-3-Clause
"""Everything numeric that a bag holds, before anybody knows what it means."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Stream
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.bags.clocks.empty_stamps import empty_stamps
from jointscope.tools.bags.clocks.one_time_axis import on_one_time_axis
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.fitting_messages import read_columns
from jointscope.tools.bags.messages.message_type import MessageType
from jointscope.tools.bags.messages.open_bag import Bag, Progress, RawTopic, open_bag
from jointscope.tools.bags.tidying.long_holes import LongHoles
from jointscope.tools.bags.tidying.not_finite import filled_in
from jointscope.tools.bags.tidying.stream_notices import Timing, timing
from jointscope.tools.bags.tidying.tidy_samples import ordered_samples, plausible_samples
from jointscope.tools.init.streams.joint_topics import COMMANDED, joint_by_joint
from jointscope.tools.init.streams.known_fields import KnownField, known_fields

Array = NDArray[np.float64]

MEASURED = ("position", "rate")
"""Quantities that a sensor fills, so that single wild samples in them are none."""


@dataclass(frozen=True)
class Signal:
    """One field of one topic.

    Attributes:
        topic, msgtype, field: where it is.
        names: joint names of its columns; empty where the messages name none.
        times: stamps, strictly increasing, shape (n,) [s]; zero is the same for all signals of a bag.
        values: shape (n, m), in the unit of the bag.
        stamped: whether the messages carry a stamp.
        quantity: what its field says it is: "position", "effort", "rate" or "numbers".
        joints: whose command each column is, where the topics say so that are joined in it.
        sent: the same with all messages, where some were left out; streams are compared one for one by it.
        filled: where a value only stands for one that was no number, shape (n, m); None where all were measured.
        trouble: why nobody can tell whose its values are; its quantity is empty then.
    """

    topic: str
    msgtype: str
    field: str
    names: tuple[str, ...]
    times: Array
    values: Array
    stamped: bool
    quantity: str = ""
    sent: Signal | None = None
    joints: tuple[str, ...] = ()
    filled: NDArray[np.bool_] | None = None
    trouble: str = ""

    @property
    def as_sent(self) -> Signal:
        """With all messages."""
        return self.sent or self

    @property
    def timing(self) -> Timing:
        """How regular it is."""
        return timing(self.times)

    @property
    def commanded(self) -> bool:
        """Whether it says what a controller wants."""
        return bool(COMMANDED.search(self.topic.lower()) or COMMANDED.search(self.field.lower()))

    def columns(self, names: tuple[str, ...]) -> Array:
        """Values of some joints, shape (n, k); by place, counted from 0, where the messages name none."""
        return self.values[:, self._places(names)]

    def _places(self, names: tuple[str, ...]) -> list[int]:
        if self.names:
            return [self.names.index(name) for name in names]
        return [int(name) for name in names] if all(name.isdecimal() for name in names) else list(range(len(names)))

    def stream(self, names: tuple[str, ...], factor: float | Array = 1.0) -> Stream:
        """Some joints as a stream, finite samples only, times a factor."""
        values = self.columns(names) * factor
        good = np.isfinite(values).all(axis=1)
        filled = None
        if self.filled is not None:
            good &= ~self.filled[:, self._places(names)].all(axis=1)  # messages about other joints
            filled = self.filled[good][:, self._places(names)]
        return Stream(self.topic, self.times[good], values[good], names, "", filled=filled)


def read_signals(path: Path, progress: Progress | None = None, joints: Sequence[str] = ()) -> list[Signal]:
    """All signals of a bag, in the order of its topics; at the end commands on one topic for each of some joints.

    Raises:
        RecordingError: the bag cannot be read, or holds nothing that a robot file could use.
    """
    with open_bag(path) as bag:
        types = {topic: kind for topic in bag.topics if (kind := _useful_type(bag, topic)) is not None}
        joined = joint_by_joint(bag, joints)
        types |= {topic: bag.message_type(topic) for topic in joined}
        raw = bag.read(list(types), progress)
    filled = {topic: kind for topic, kind in types.items() if raw[topic].data}
    start = min((min(part.received) for part in raw.values() if part.received), default=0)
    fields = [
        field
        for topic, kind in filled.items()
        for known in known_fields(kind, raw[topic].data[0])
        if (field := _field(raw[topic], kind, known)) is not None
    ]
    timed, _, _ = on_one_time_axis(
        {field.label: field.samples for field in fields}, {field.label for field in fields if field.stamped}
    )
    troubles: list[RecordingError] = []
    found = [_signal(field, timed[field.label], start, troubles) for field in fields]
    signals = [signal for signal in found if signal is not None]
    if troubles and not any(signal.quantity == "position" and not signal.commanded for signal in signals):
        raise troubles[0]  # else the bag would seem to hold no positions
    signals = [replace(signal, joints=joined.get(signal.topic, ())) for signal in signals]
    holes = LongHoles.of([signal.times for signal in signals])
    signals = [replace(signal, times=holes.shortened(signal.times)) for signal in signals]
    if not signals:
        raise RecordingError(
            f"{path} holds no messages with positions or efforts of joints (sensor_msgs/msg/JointState, states of "
            f"controllers, arrays of motors); jointscope info {path} shows what is there"
        )
    return signals


def complain_of_lengths(signals: Sequence[Signal], words: Sequence[str]) -> None:
    """Complains about lists that are shorter or longer than those of their names, where nothing else tells it.

    Raises:
        RecordingError: there is one whose field speaks of what is missing.
    """
    for signal in signals:
        if signal.trouble and any(word in signal.field.lower() for word in words):
            raise RecordingError(signal.trouble)


def _useful_type(bag: Bag, topic: str) -> MessageType | None:
    """The type of a topic that could tell something about joints; one that cannot be understood does not."""
    if len(bag.type_names(topic)) != 1:
        return None
    try:
        kind = bag.message_type(topic)
    except RecordingError:
        return None
    interfaces = any(name == "interface_values" for name, _ in kind.fields)
    return kind if interfaces or known_fields(kind, None) else None


@dataclass(frozen=True)
class _Field:
    """One field of the messages of a topic, in the order of the bag."""

    topic: str
    kind: MessageType
    known: KnownField
    names: tuple[str, ...]
    samples: TimedSamples
    stamped: bool
    trouble: str = ""

    @property
    def label(self) -> str:
        return f"{self.topic} {self.known.path}"


def _field(raw: RawTopic, kind: MessageType, known: KnownField) -> _Field | None:
    """One field; None where it is empty in some messages or changes its length."""
    try:
        columns = read_columns(raw, kind, known.path)
    except RecordingError:
        return None
    width = columns.values.shape[1]
    names = columns.names or ()
    trouble = ""
    if 0 < width != len(names) > 0:
        trouble = (
            f"{raw.name} has {counted(width, 'value')} in `{known.path}` for {len(names)} names ({', '.join(names)}); "
            "expected one for each, in their order, so that it is known whose they are: let the driver fill in the "
            "others (NaN where it has none), or name in each message only those that it has"
        )
        names = ()
    elif width == 0 or len(set(names)) != len(names):
        return None
    received = columns.of(raw.received_ns)
    stamps = received if columns.stamps is None else columns.stamps
    samples = TimedSamples(stamps, received, columns.values, columns.absent)
    return _Field(
        raw.name, kind, known, names, samples, columns.stamps is not None and not empty_stamps(samples), trouble
    )


def _signal(field: _Field, timed: TimedSamples, start_ns: int, troubles: list[RecordingError]) -> Signal | None:
    """A field as a signal, from its samples on the clock of all; None where its times cannot be told."""
    known = field.known

    def signal(samples: TimedSamples, sent: Signal | None = None) -> Signal:
        times = (samples.stamps - start_ns) / 1e9
        later = np.diff(times, prepend=-np.inf) > 0  # far from zero, seconds do not tell all nanoseconds apart
        names, values = field.names, samples.values[later]
        return Signal(
            field.topic, field.kind.name, known.path, names, times[later], values, field.stamped,
            "" if field.trouble else known.quantity, sent, trouble=field.trouble,
            filled=None if samples.filled is None else samples.filled[later],
        )  # fmt: skip

    try:
        ordered = ordered_samples(field.topic, timed)
        is_sensor = known.quantity in MEASURED
        samples = plausible_samples(field.topic, ordered) if is_sensor else filled_in(ordered, acts_on=True)
    except RecordingError as err:  # what nobody can tell the time of is no use; others may do without it
        troubles.append(err)
        return None
    return signal(samples, signal(ordered) if len(ordered) > len(samples) else None)
