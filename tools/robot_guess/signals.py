# SPDX-License-Identifier: BSD-3-Clause
"""Everything numeric that a bag holds, before anybody knows what it means."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.recording import Stream
from jointscope.tools.bags.message_type import MessageType
from jointscope.tools.bags.open_bag import Bag, Progress, RawTopic, open_bag
from jointscope.tools.bags.read_recording import read_columns
from jointscope.tools.bags.stream_notices import Timing, timing
from jointscope.tools.bags.tidy_samples import tidy_samples
from jointscope.tools.bags.timed_samples import TimedSamples

Array = NDArray[np.float64]

JOINT_STATE = "sensor_msgs/msg/JointState"
FIELDS = {
    JOINT_STATE: ("position", "effort"),
    "sensor_msgs/msg/Imu": ("angular_velocity",),
    "std_msgs/msg/Float64MultiArray": ("data",),
    "std_msgs/msg/Float32MultiArray": ("data",),
}
"""Message types that are understood, and what of them a robot file can use."""

MEASURED = ("position", "angular_velocity")
"""Fields that a sensor fills, so that single wild samples in them are none."""


@dataclass(frozen=True)
class Signal:
    """One field of one topic.

    Attributes:
        topic, msgtype, field: where it is.
        names: joint names of its columns; empty where the messages name none.
        times: stamps, strictly increasing, shape (n,) [s]; zero is the same for all signals of a bag.
        values: shape (n, m), in the unit of the bag.
        stamped: whether the messages carry a stamp.
    """

    topic: str
    msgtype: str
    field: str
    names: tuple[str, ...]
    times: Array
    values: Array
    stamped: bool

    @property
    def timing(self) -> Timing:
        """How regular it is."""
        return timing(self.times)

    def columns(self, names: tuple[str, ...]) -> Array:
        """Values of some joints, shape (n, k); by place where the messages name none."""
        index = [self.names.index(name) for name in names] if self.names else list(range(len(names)))
        return self.values[:, index]

    def stream(self, names: tuple[str, ...], factor: float | Array = 1.0) -> Stream:
        """Some joints as a stream, finite samples only, times a factor."""
        values = self.columns(names) * factor
        good = np.isfinite(values).all(axis=1)
        return Stream(self.topic, self.times[good], values[good], names, "")

    def moving(self, names: tuple[str, ...]) -> bool:
        """Whether every one of some joints has finite samples of which some differ."""
        if not set(names) <= set(self.names or names) or self.values.shape[1] < len(names):
            return False
        values = self.columns(names)
        good = np.isfinite(values).all(axis=1)
        return bool(good.mean() > 0.5 and np.any(np.ptp(values[good], axis=0) > 0))


def read_signals(path: Path, progress: Progress | None = None) -> list[Signal]:
    """All signals of a bag, in the order of its topics.

    Raises:
        RecordingError: the bag cannot be read, or holds nothing that a robot file could use.
    """
    with open_bag(path) as bag:
        types = {topic: bag.message_type(topic) for topic in bag.topics if _is_known(bag, topic)}
        raw = bag.read(list(types), progress)
    filled = {topic: kind for topic, kind in types.items() if raw[topic].data}
    start = min((min(part.received) for part in raw.values() if part.received), default=0)
    found = [_signal(raw[topic], kind, field, start) for topic, kind in filled.items() for field in FIELDS[kind.name]]
    signals = [signal for signal in found if signal is not None]
    if not signals:
        kinds = ", ".join(FIELDS)
        raise RecordingError(f"{path} holds no messages of {kinds}; jointscope info {path} shows what is there")
    return signals


def _is_known(bag: Bag, topic: str) -> bool:
    return len(bag.type_names(topic)) == 1 and bag.type_names(topic)[0] in FIELDS


def _signal(raw: RawTopic, kind: MessageType, field: str, start_ns: int) -> Signal | None:
    """One field; None where it is empty in some messages or changes its length."""
    try:
        columns = read_columns(raw, kind, field)
    except RecordingError:
        return None
    if columns.values.shape[1] == 0:
        return None
    received = columns.of(raw.received_ns)
    stamps = received if columns.stamps is None else columns.stamps
    samples = TimedSamples(stamps, received, columns.values)
    try:
        samples = tidy_samples(raw.name, samples, columns.stamps is not None, sensor=field in MEASURED)
    except RecordingError:  # what nobody can tell the time of is no use; a robot file may still need other topics
        return None
    names = columns.names or ()
    times = (samples.stamps - start_ns) / 1e9
    return Signal(raw.name, kind.name, field, names, times, samples.values, columns.stamps is not None)
