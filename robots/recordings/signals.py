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
        """Between two samples [s]."""
        return float(np.median(np.diff(self.times)))

    def even(self, start: float, count: int, path: str) -> tuple[Array, float]:
        """Samples from a time on, shape (count, c), and the time of the first one.

        Raises:
            RecordingError: they end before, or are not evenly spaced.
        """
        first = int(np.searchsorted(self.times, start - HALF_A_STEP * self.step))
        times = self.times[first : first + count]
        if len(times) < count or times[0] - start > self.step:
            raise RecordingError(
                f"{path}: {self.names[0]}: an experiment of {count * self.step:g} s is said to begin at {start:g} s, "
                f"but the samples end at {self.times[-1]:g} s; the excitation belongs to another recording, or this "
                "one was cut off"
            )
        off = np.abs(times - times[0] - self.step * np.arange(count))
        if off.max() > UNEVEN * self.step:
            raise RecordingError(
                f"{path}: {self.names[0]}: samples near {times[int(np.argmax(off))]:.4g} s are "
                f"{1e3 * off.max():.3g} ms beside an even grid of {1e3 * self.step:.4g} ms; frequency responses need "
                "every sample: record again without lost ones"
            )
        return self.values[first : first + count], float(times[0])


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
    if abs(exact - round(exact)) > 1e-3 * max(1.0, 1e-3 * exact):
        raise RecordingError(
            f"{path}: a period of {1.0 / f0:g} s has {exact:.2f} samples of {1e3 * step:.4g} ms; expected a whole "
            "number: choose a period that is a multiple of the sampling time"
        )
    return round(exact)


def named(names: Sequence[str], most: int = 6) -> str:
    """Names, or how many there are beside the first ones."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
