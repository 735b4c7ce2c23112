# SPDX-License-Identifier: BSD-3-Clause
"""What went into a system and what came out, whatever it is, and how it was excited."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError

Array = NDArray[np.float64]
HALF_A_STEP = 0.5  # of the sampling: how far a sample may be from where a period begins
UNEVEN = 0.2  # of a step that stamps may be beside an even grid
TOGETHER = 9  # stamps that are, where a sample was lost; a single one only came late
GAP = 1.5  # steps without a sample end a stretch
SAME_CLOCK = 1e-4  # by which the clock of the stamps may run otherwise than the one of the excitation
WHOLE = 0.25  # samples that a period may be off by for it


@dataclass(frozen=True)
class Signal:
    """Samples of some channels.

    Attributes:
        times: since the first stamp of the bag, shape (n,) [s].
        values: shape (n, c).
        names: of the channels, shape (c,).
        held: whether each value acts until the next one, as a command does; else it was measured.
    """

    times: Array
    values: Array
    names: tuple[str, ...]
    held: bool = False

    @cached_property
    def step(self) -> float:
        """Between two samples, the slope of the stamps in stretches without a gap [s].

        Stamps jitter: the median of a thousand steps of 1 ms that jitter by 10 us is a sample off in a few seconds.
        """
        steps = np.diff(self.times)
        step = float(np.median(steps))
        stretch = np.concatenate([[0], np.cumsum(steps > GAP * step)])
        in_time = np.ones(len(self.times))
        for _ in range(2):  # the second time without single stamps that came late
            size = np.maximum(np.bincount(stretch, in_time), 1.0)
            n, t = (
                x - (np.bincount(stretch, in_time * x) / size)[stretch]
                for x in (np.arange(len(self.times), dtype=np.float64), self.times)
            )
            step = float((in_time * n) @ t / max((in_time * n) @ n, 1.0)) or step
            in_time = (np.abs(t - step * n) <= UNEVEN * step).astype(np.float64)
        return step

    def even(self, start: float, count: int, path: str) -> tuple[Array, float]:
        """Samples from a time on, shape (count, c), and the time of the first one, by all their stamps.

        Raises:
            RecordingError: they end before, or are not evenly spaced.
        """
        first = int(np.searchsorted(self.times, start - HALF_A_STEP * self.step))
        times = self.times[first : first + count]
        if start < self.times[0] - self.step:
            raise RecordingError(
                f"{path}: {self.names[0]}: an experiment is said to begin at {start:g} s, but the samples begin at "
                f"{self.times[0]:g} s; correct its start, or leave out the first period as a transient"
            )
        if len(times) < count or times[0] - start > self.step:
            raise RecordingError(
                f"{path}: {self.names[0]}: an experiment of {count * self.step:g} s is said to begin at {start:g} s, "
                f"but the samples end at {self.times[-1]:g} s; the excitation belongs to another recording, or this "
                "one was cut off"
            )
        late = times - self.step * np.arange(count)
        begin = float(np.median(late))
        near = np.lib.stride_tricks.sliding_window_view(np.pad(late, TOGETHER // 2, mode="reflect"), TOGETHER)
        off = np.abs(np.median(near, axis=1) - begin)
        if off.max() > UNEVEN * self.step:
            place = int(np.argmax(np.abs(np.diff(times) - self.step)))
            raise RecordingError(
                f"{path}: {self.names[0]}: samples near {times[place]:.4g} s are "
                f"{1e3 * off.max():.3g} ms beside an even grid of {1e3 * self.step:.4g} ms; frequency responses need "
                "every sample: record again without lost ones"
            )
        in_time = np.abs(late - begin) <= UNEVEN * self.step
        return self.values[first : first + count], float(late[in_time].mean())


@dataclass(frozen=True)
class Signals:
    """Inputs and outputs of a recording.

    Attributes:
        path: where they come from.
        sha256: of that file.
        inputs, outputs: what went in and what came out; they may have clocks and rates of their own.
    """

    path: str
    sha256: str
    inputs: Signal
    outputs: Signal


@dataclass(frozen=True)
class Experiment:
    """A stretch of steady periods.

    Attributes:
        realisation: number of the set of random phases.
        number: of the experiment in it: each drives the inputs in another combination.
        sign: of the excitation, 1 or -1; two experiments that differ in it alone are a pair.
        start: of the first period [s].
        periods: how many follow each other.
        transient: how many of them at the begin are not steady.
    """

    realisation: int
    number: int
    sign: int
    start: float
    periods: int
    transient: int = 0


@dataclass(frozen=True)
class Excitation:
    """How a recording was excited.

    Attributes:
        f0: distance of the lines, the inverse of a period [Hz].
        lines: that were excited, in multiples of f0, shape (l,).
        experiments: in the order of time.
        carrier: frequency of a motion that goes on in all experiments alike [Hz]; 0 for none.
        source: what says so: a file, or "the recording".
    """

    f0: float
    lines: NDArray[np.intp]
    experiments: tuple[Experiment, ...]
    carrier: float = 0.0
    source: str = "the recording"

    @property
    def frequencies(self) -> Array:
        """Of the lines, shape (l,) [Hz]."""
        return np.asarray(self.f0 * self.lines)


def whole_periods(f0: float, step: float, path: str) -> int:
    """Samples in a period.

    Raises:
        RecordingError: it is no whole number of them.
    """
    exact = 1.0 / (f0 * step)
    if abs(exact - round(exact)) > min(max(1e-3, SAME_CLOCK * exact), WHOLE):
        raise RecordingError(
            f"{path}: a period of {1.0 / f0:g} s has {exact:.2f} samples of {1e3 * step:.4g} ms; expected a whole "
            "number: choose a period that is a multiple of the sampling time"
        )
    return round(exact)


def named(names: Sequence[str], most: int = 6) -> str:
    """Names, or how many there are beside the first ones."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
