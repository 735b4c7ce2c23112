# SPDX-License-Identifier: BSD-3-Clause
"""Messages in the order in which they were received: what a control loop would have seen.

A Recording is tidied up: sorted by stamp, without duplicates. Arrivals are not: late, repeated and unreadable (NaN)
samples stand where they came in. A long recording is a sequence of such blocks, so that it never lies in memory whole.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Arrivals:
    """Consecutive messages of several streams.

    Attributes:
        names: names of the streams.
        stream: index of each message's stream in `names`, shape (n,).
        row: its row in the values of that stream, shape (n,).
        stamps: time of measurement, on the time axis of the recording, shape (n,) [s].
        received: time of writing to the bag, on the same axis, shape (n,) [s].
        values: samples of each stream, shapes (m, c), in SI units.
        about: which channels the messages of each stream are about, shapes (m, c); None where all are about all.
    """

    names: tuple[str, ...]
    stream: NDArray[np.intp]
    row: NDArray[np.intp]
    stamps: Array
    received: Array
    values: tuple[Array, ...]
    about: tuple[NDArray[np.bool_] | None, ...] = ()

    def __len__(self) -> int:
        return len(self.stamps)

    def __iter__(self) -> Iterator[tuple[float, str, float, Array]]:
        """Time of arrival [s], name of the stream, stamp [s] and sample of every message."""
        for k, row, stamp, received in zip(
            self.stream.tolist(), self.row.tolist(), self.stamps.tolist(), self.received.tolist(), strict=True
        ):
            yield received, self.names[k], stamp, self.values[k][row]

    def channels(self) -> Iterator[NDArray[np.bool_] | None]:
        """Which channels each message is about, shape (c,); None for all."""
        about = self.about or (None,) * len(self.names)
        for k, row in zip(self.stream.tolist(), self.row.tolist(), strict=True):
            part = about[k]
            yield None if part is None else part[row]

    @staticmethod
    def merged(names: tuple[str, ...], parts: list[tuple[Array, Array, Array]], place: list[Array]) -> Arrivals:
        """Streams woven together.

        Args:
            names: names of the streams.
            parts: stamps, times of arrival and samples of each stream.
            place: key of every message of each stream by which they are put in order.
        """
        counts = [len(stamps) for stamps, _, _ in parts]
        order = np.argsort(np.concatenate(place), kind="stable")
        return Arrivals(
            names,
            np.repeat(np.arange(len(names)), counts)[order],
            np.concatenate([np.arange(count) for count in counts])[order],
            np.concatenate([stamps for stamps, _, _ in parts])[order],
            np.concatenate([received for _, received, _ in parts])[order],
            tuple(values for _, _, values in parts),
        )

    @staticmethod
    def of(recording: Recording) -> Arrivals:
        """The samples of a recording as they were received; those without such a time arrive when they are measured.

        Where sensors and a command arrive together, the sensors come first: a controller reads before it commands.
        """
        names = (*(name for name in recording.streams if name != "command"), "command")
        streams = [recording.streams[name] for name in names]
        parts = [(s.times, s.times if s.received is None else s.received, s.values) for s in streams]
        return Arrivals.merged(names, parts, [received for _, received, _ in parts])
