# SPDX-License-Identifier: BSD-3-Clause
"""What was measured: named streams of samples, each at its own times.

A Recording holds no model and no resampling. Times are float seconds since the start of the recording; the
absolute start in nanoseconds is kept so that a sample can be found again in its bag.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError

Array = NDArray[np.float64]

GRID = 1000  # instants at which a recording is looked at
TOLD_WITH_RESULTS = ("clock", "foreign", "glitch", "end_stop", "dropped", "staircase", "mimic", "coarse")
"""Kinds of notices that whoever believes a result has to know: the reader took data away, changed their times, or the
robot file contradicts them."""
COMMAND_PERIODS, COMMAND_SECONDS = 5.0, 0.01  # [1], [s] a pause of the commands is longer than both
FEWEST_STEPS = 10  # that show a period
SPREAD, LONG_TAIL = 0.5, 3.0  # [periods] typical and 90 % largest deviation of steps, above which there is no period
LATEST = 8  # screenings that a recording keeps
SMALLEST_SHARE = 0.2  # of the samples that have to be left; a hole in the recording takes none away


@dataclass(frozen=True)
class Stream:
    """Samples of one sensor, or of the command, in the order of their measurement times.

    Attributes:
        name: key of the sensor in the robot file ("motor_encoder", "imu1"), or "command".
        times: time of measurement, strictly increasing, shape (n,) [s].
        values: samples, shape (n, m), in the SI unit of the sensor.
        channels: name of each column ("joint1.motor_position", "imu1.x", "joint1.command").
        unit: SI unit of the values ("rad", "rad/s", "1" for a duty cycle, "V", "A", "N m").
        received: time at which the message was written to the bag, shape (n,) [s].
        filled: where a value only stands for one that was no number, shape (n, m); None where all were measured.
    """

    name: str
    times: Array
    values: Array
    channels: tuple[str, ...]
    unit: str
    received: Array | None = None
    filled: NDArray[np.bool_] | None = None

    def __len__(self) -> int:
        return len(self.times)

    @property
    def measured(self) -> Array:
        """The values with NaN where nothing was measured, shape (n, m)."""
        return self.values if self.filled is None else np.where(self.filled, np.nan, self.values)

    @property
    def whole(self) -> Stream:
        """The samples of which every channel was measured."""
        return self if self.filled is None else self.take(np.asarray(~self.filled.any(axis=1)))

    @cached_property
    def periods(self) -> Array:
        """Usual time from one sample of each channel to its next, shape (m,) [s]; infinite for fewer than two.

        Several drivers may speak on one topic, each at its own rate and some just behind each other: what lies between
        two messages of different ones is no period of either.
        """
        if self.filled is None:
            return np.full(self.values.shape[1], _middle_step(self.times))
        return np.array([_middle_step(self.times[seen]) for seen in ~self.filled.T])

    def channel(self, index: int) -> Stream:
        """The samples of which one channel was measured, with that channel alone."""
        one = replace(self, values=self.values[:, [index]], channels=(self.channels[index],), filled=None)
        return one if self.filled is None else one.take(np.asarray(~self.filled[:, index]))

    def exchanged(self, order: Sequence[int]) -> Stream:
        """The same channels with each other's samples, column k with those of `order[k]`."""
        filled = None if self.filled is None else self.filled[:, order]
        return replace(self, values=self.values[:, order], filled=filled)

    def has_period(self, index: int) -> bool:
        """Whether samples of a channel come again and again, not when something changes."""
        steps, period = np.diff(self.channel(index).times), self.periods[index]
        if len(steps) < FEWEST_STEPS:
            return False
        typical = float(np.median(np.abs(steps - period)))
        return typical < SPREAD * period and float(np.quantile(steps, 0.9)) < LONG_TAIL * period

    def silences(self, periods: float, seconds: float) -> dict[int, list[tuple[float, float]]]:
        """Stretches (t0, t1) [s] without samples of a channel that are longer than so many periods and seconds.

        Among several drivers on one topic one may begin late or end early, and is silent until then or from then on.
        """
        found = {}
        for k, period in enumerate(self.periods):
            own = self.channel(k).times
            if len(own) > 1:
                edges = np.concatenate([self.times[:1], own, self.times[-1:]])
                long = np.flatnonzero(np.diff(edges) > max(periods * float(period), seconds))
                found[k] = [(float(edges[i]), float(edges[i + 1])) for i in long]
        return found

    def take(self, index: slice | NDArray[np.bool_]) -> Stream:
        """Some of the samples."""
        received = None if self.received is None else self.received[index]
        filled = None if self.filled is None else self.filled[index]
        return replace(self, times=self.times[index], values=self.values[index], received=received, filled=filled)

    def between(self, t0: float, t1: float) -> Stream:
        """The samples with t0 <= time < t1 [s]."""
        return self.take(slice(*np.searchsorted(self.times, [t0, t1])))


@dataclass(frozen=True)
class Notice:
    """One thing that the reader did to the data, or saw in them.

    Attributes:
        stream: name of the stream.
        kind: one of "unit", "axes", "mirrored", "gravity", "torque", "limit", "saturation", "jump", "clock",
            "foreign", "glitch", "dropped", "gap", "staircase", "posture", "mimic", "coarse", "clipping",
            "end_stop", "out_of_order", "duplicate", "info", "jitter", "current".
        count: number of samples concerned.
        text: the whole sentence for the user.
    """

    stream: str
    kind: str
    count: int
    text: str


@dataclass(frozen=True, repr=False)
class Recording:
    """All streams of one bag.

    Attributes:
        path: where the bag lies, as the user gave it.
        sha256: hash of the bag's content (for a folder: of its storage files in order), hexadecimal.
        start_ns: stamp of time zero [ns].
        streams: by name; always contains "command".
        notices: what was dropped and why, and what looked odd.
        goal: goal positions of a position-controlled robot [rad], NaN where a drive was off; None without.
        left_out: stretches (t0, t1) [s] in which something acted that does not belong to the robot: its equations of
            motion do not hold there, and no model is judged by them.
        sticking: by joint, stretches (t0, t1) [s] in which dry friction holds it, or may: the torque in the equation of
            its motor is any of a band, so that it tells nothing.
        posture: positions [rad] or [m] of joints that are not the robot's and stand still, by name.
        shortened: whether long holes were made short, so that times behind them are not those of the stamps.
        screenings: the latest, each with its robot, streams and notices, for all who ask for the same again; a changed
            copy has none yet.
    """

    path: str
    sha256: str
    start_ns: int
    streams: dict[str, Stream]
    notices: list[Notice] = field(default_factory=list)
    goal: Stream | None = None
    left_out: tuple[tuple[float, float], ...] = ()
    sticking: Mapping[str, tuple[tuple[float, float], ...]] = field(default_factory=dict)
    posture: Mapping[str, float] = field(default_factory=dict)
    shortened: bool = False
    screenings: deque[tuple[object, tuple[Stream, ...], list[Notice]]] = field(
        default_factory=lambda: deque(maxlen=LATEST), init=False, compare=False
    )

    def __repr__(self) -> str:
        """One line: "train.mcap: 16.000 s; command (16000 samples, 3 channels), imu1 (16000 samples, 3 channels)"."""
        streams = [f"{s.name} ({len(s)} samples, {len(s.channels)} channels)" for s in self.streams.values()]
        length = f"{self.duration:.3f} s" if any(map(len, self.streams.values())) else "empty"
        return f"{self.path}: {length}; {', '.join(streams)}"

    @property
    def command(self) -> Stream:
        """The command stream."""
        return self.streams["command"]

    @property
    def span(self) -> tuple[float, float]:
        """Times of the first and the last sample of any stream [s]."""
        streams = [stream for stream in self.streams.values() if len(stream.times)]
        return min(float(s.times[0]) for s in streams), max(float(s.times[-1]) for s in streams)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample of any stream [s]."""
        first, last = self.span
        return last - first

    def shares_samples_with(self, other: Recording) -> bool:
        """Whether both are of one bag and at one time, as two parts of a recording are not."""
        (first, last), (begins, ends) = self.span, other.span
        return bool(self.sha256) and self.sha256 == other.sha256 and first <= ends and begins <= last

    @property
    def sample_count(self) -> int:
        """Number of messages in all streams."""
        return sum(len(s) for s in self.streams.values())

    def between(self, t0: float, t1: float) -> Recording:
        """The part with t0 <= time < t1 [s], on the same time axis; the command that acts at t0 comes along."""
        streams = {name: stream.between(t0, t1) for name, stream in self.streams.items()}
        before = int(np.searchsorted(self.command.times, t0)) - 1
        held = streams["command"]
        if before >= 0 and not (len(held) and held.times[0] == t0):
            received = None if held.received is None else np.append(t0, held.received)
            streams["command"] = replace(
                held,
                times=np.append(t0, held.times),
                values=np.vstack([self.command.values[before], held.values]),
                received=received,
                filled=None if held.filled is None else np.vstack([np.zeros(held.filled.shape[1], bool), held.filled]),
            )
        goal = None if self.goal is None else self.goal.between(t0, t1)
        return replace(self, streams=streams, goal=goal)

    def leaving_out(self, stretches: Sequence[tuple[float, float]]) -> Recording:
        """The same recording with further stretches (t0, t1) [s] left out.

        Raises:
            RecordingError: a stretch ends before it begins or lies outside, or hardly anything would be left.
        """
        first = min(float(s.times[0]) for s in self.streams.values())
        last = first + self.duration
        for t0, t1 in stretches:
            if not t0 < t1 or t1 <= first or t0 >= last:
                raise RecordingError(
                    f"{self.path}: cannot leave out {t0:g} to {t1:g} s; expected a beginning before its end, within "
                    f"{first:.2f} to {last:.2f} s"
                )
        both = (*self.left_out, *((max(t0, first), min(t1, last)) for t0, t1 in stretches))
        without = replace(self, left_out=both)
        left = float(np.mean(np.concatenate([without.are_judged(s.times) for s in self.streams.values()])))
        if left < SMALLEST_SHARE:
            raise RecordingError(
                f"{self.path}: only {100 * left:.0f} % would be left, expected at least {100 * SMALLEST_SHARE:.0f} %; "
                "cut the recording, or leave out less"
            )
        return without

    def judged_share(self, t0: float, t1: float) -> float:
        """Share of a stretch that is not left out."""
        return float(np.mean(self.are_judged(np.linspace(t0, t1, GRID))))

    def are_judged(self, times: Array, horizon: Array | float = 0.0) -> NDArray[np.bool_]:
        """Whether what happened in the last `horizon` seconds before each time was all the robot's own, shape (m,)."""
        return ~_touched(self.left_out, times, horizon)

    def sticks(self, joint: str, times: Array, horizon: Array | float = 0.0) -> NDArray[np.bool_]:
        """Whether friction may have held a joint in the last `horizon` seconds before each time, shape (m,)."""
        return _touched(self.sticking.get(joint, ()), times, horizon)


def unknown_commands(command: Stream) -> dict[int, list[tuple[float, float]]]:
    """Stretches (t0, t1) [s] in which nobody knows what some channels commanded, by channel.

    Commands that are sent only when they change have no period, and are silent when nothing changes.
    """
    silences = command.silences(COMMAND_PERIODS, COMMAND_SECONDS)
    return {k: stretches for k, stretches in silences.items() if stretches and command.has_period(k)}


def _middle_step(times: Array) -> float:
    return float(np.median(np.diff(times))) if len(times) > 1 else float(np.inf)


def _touched(stretches: Sequence[tuple[float, float]], times: Array, horizon: Array | float) -> NDArray[np.bool_]:
    touched = np.zeros(len(times), bool)
    for t0, t1 in stretches:
        touched |= (times >= t0) & (times - horizon <= t1)
    return touched


def must_count_once(recordings: Iterable[tuple[str, str]], option: str = "") -> None:
    """Refuses a recording that is given twice.

    Args:
        recordings: path and hash of the content of each; nobody compares one without a hash.
        option: with which they are given; none of recordings of motion.

    Raises:
        RecordingError: a path and its twin.
    """
    seen: dict[str, str] = {}
    for path, sha256 in recordings:
        if sha256 and sha256 in seen:
            raise RecordingError(
                f"{option and f'{option}: '}{path} is the same recording as {seen[sha256]}; give every recording once, "
                "or its samples count twice"
            )
        seen[sha256] = path
