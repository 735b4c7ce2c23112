# SPDX-License-Identifier: BSD-3-Clause
"""Messages in the order in which they reach a controller that runs a thousand times a second.

In a cycle the controller takes in what has arrived, asks for the state, and sends a command; so the command of a cycle
comes after its samples. `disturbed` loses messages, delays them, and silences a gyro.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

CYCLE = 1e-3  # [s]
SAME = 1e-6  # [s] stamps nearer than this are those of one tick


class Message(NamedTuple):
    """A sample or a command: time of arrival and stamp [s], name of the stream, values in SI units."""

    arrives: float
    stamp: float
    stream: str
    values: Array


def in_order(recording: Recording) -> list[Message]:
    """All messages; each arrives at once."""
    messages = [
        Message(float(t), float(t), stream.name, values)
        for stream in recording.streams.values()
        for t, values in zip(stream.times, stream.values, strict=True)
    ]
    return sorted(messages, key=lambda m: (round(m.arrives / SAME), m.stream == "command"))


def disturbed(
    messages: Iterable[Message],
    rng: np.random.Generator,
    *,
    lost: float,
    latest: float,
    silent: tuple[str, float, float],
) -> list[Message]:
    """What is left of messages on a bad day.

    Args:
        messages: all of them.
        rng: decides.
        lost: share of messages that never arrive.
        latest: longest delay; delays are uniform from zero, so messages overtake each other [s].
        silent: name of a stream from which nothing comes between two times [s].
    """
    name, since, until = silent
    kept = [
        m._replace(arrives=m.stamp + rng.uniform(0.0, latest))
        for m in messages
        if rng.random() >= lost and not (m.stream == name and since <= m.stamp < until)
    ]
    return sorted(kept, key=lambda m: (m.arrives, m.stream == "command"))


def cycles(messages: Iterable[Message]) -> Iterator[tuple[float, list[Message]]]:
    """The controller's cycles: when each runs [s], and the messages that have arrived since the one before."""
    k, waiting = None, list[Message]()
    for message in messages:
        if k is None:
            k = round(message.arrives / CYCLE)
        while message.arrives > k * CYCLE + SAME:
            yield k * CYCLE, waiting
            k, waiting = k + 1, []
        waiting.append(message)
    if k is not None:
        yield k * CYCLE, waiting
