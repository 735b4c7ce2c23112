# SPDX-License-Identifier: BSD-3-Clause
"""What looks odd in a stream without being wrong: gaps, jitter, clipping."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted, duration

Array = NDArray[np.float64]

GAP_PERIODS = 1.5  # a step longer than this many median periods, plus six times their spread, misses samples
JITTER_SHARE = 0.02  # of the median period
LONG_GAP = 3.5  # periods; shorter ones are a lost sample or two
MISSING_SHARE = 0.02  # of the samples
WORTH_SAYING = 0.2  # of the period: jitter that makes samples uneven
COARSE_STEP = 0.03  # of the rms, from which a step matters
FEWEST_LEVELS, MOST_LEVELS = 8, 400  # fewer are a test signal, more are no steps
EVEN = 1e-3  # [steps]
IMPORTANCE = (
    "unit", "axes", "mirrored", "gravity", "torque", "saturation", "jump", "clock", "foreign", "glitch", "end_stop",
    "gap", "dropped", "mimic", "posture", "staircase", "coarse", "clipping", "out_of_order", "duplicate", "info",
    "jitter",
)  # fmt: skip
CLIPPED_RUN = 3  # equal extreme samples in a row
LIMIT_SHARE = 0.2  # of the largest value of all channels: below it an extreme is no limit
CLIPPED_COUNT = 20  # samples on the plateaus of one channel


@dataclass(frozen=True)
class Timing:
    """How regular the times of a stream are.

    Attributes:
        period: median step [s].
        rate: samples per second over the whole stream [1/s].
        gaps: number of steps in which samples are missing.
        missing: samples that are missing there, estimated.
        longest_gap: longest such step [s]; 0 where there is none.
        longest_gap_at: its start [s].
        jitter: standard deviation of the other steps [s].
        irregular: number of other steps that differ from the median by more than 2 %.
    """

    period: float
    rate: float
    gaps: int
    missing: int
    longest_gap: float
    longest_gap_at: float
    jitter: float
    irregular: int


def timing(times: Array) -> Timing:
    """The regularity of increasing times, shape (n,) [s]."""
    steps = np.diff(times)
    if not len(steps):
        return Timing(0.0, 0.0, 0, 0, 0.0, 0.0, 0.0, 0)
    period = float(np.median(steps))
    spread = 1.4826 * float(np.median(np.abs(steps - period)))
    is_gap = steps > GAP_PERIODS * period + 6.0 * spread
    regular = steps[~is_gap]
    longest = int(np.argmax(steps)) if is_gap.any() else None
    return Timing(
        period=period,
        rate=len(steps) / float(times[-1] - times[0]) if times[-1] > times[0] else 0.0,
        gaps=int(is_gap.sum()),
        missing=int(np.sum(np.rint(steps[is_gap] / period) - 1)) if period > 0 else 0,
        longest_gap=float(steps[longest]) if longest is not None else 0.0,
        longest_gap_at=float(times[longest]) if longest is not None else 0.0,
        jitter=float(np.std(regular)) if len(regular) else 0.0,
        irregular=int(np.count_nonzero(np.abs(regular - period) > JITTER_SHARE * period)),
    )


def timing_notices(name: str, times: Array) -> list[Notice]:
    """Notices about gaps and jitter of a stream with these times, shape (n,) [s]; trifles are not worth a word."""
    seen, notices = timing(times), []
    if seen.longest_gap > LONG_GAP * seen.period or seen.missing > MISSING_SHARE * len(times):
        text = (
            f"{name}: {counted(seen.gaps, 'gap')}, about {counted(seen.missing, 'sample')} missing; the longest is "
            f"{duration(seen.longest_gap)} at {seen.longest_gap_at:.3f} s"
        )
        notices.append(Notice(name, "gap", seen.gaps, text))
    if seen.jitter > WORTH_SAYING * seen.period:
        text = (
            f"{name}: samples come every {duration(seen.period)}, give or take {duration(seen.jitter)}; each counts at "
            "its own stamp"
        )
        notices.append(Notice(name, "jitter", seen.irregular, text))
    return notices


def by_importance(notices: Sequence[Notice]) -> list[Notice]:
    """The same notices, what matters most first."""
    return sorted(notices, key=lambda notice: IMPORTANCE.index(notice.kind) if notice.kind in IMPORTANCE else 0)


def clipping_notices(name: str, values: Array, channels: tuple[str, ...], unit: str) -> list[Notice]:
    """A notice about channels that stay at exactly their extreme value while they move.

    Args:
        name: name of the stream.
        values: samples, shape (n, m); NaN was not measured.
        channels: name of each column.
        unit: unit of the values.
    """
    parts, total = [], 0
    largest = float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
    for column, channel in zip(values.T, channels, strict=True):
        column = column[np.isfinite(column)]
        low, high = (column.min(), column.max()) if len(column) else (0.0, 0.0)
        for extreme in (low, high):
            # the smaller end of a range is where a signal rests, not a limit
            is_limit = abs(extreme) > LIMIT_SHARE * largest
            count = _clipped(column, extreme) if is_limit else 0
            if count >= CLIPPED_COUNT:
                parts.append(f"{channel} at {extreme:.6g}{'' if unit == '1' else ' ' + unit} in {count} samples")
                total += count
    if not parts:
        return []
    meaning = " (what acted may be less than what was asked for)" if name == "command" else ""
    if name != "command" and unit != "1":
        meaning = " (beyond it nothing is measured: those samples are too small)"
    return [Notice(name, "clipping", total, f"{name} stays at a limit while it moves{meaning}: {'; '.join(parts)}")]


def step_notices(name: str, values: Array, channels: tuple[str, ...], unit: str) -> list[Notice]:
    """A notice about commands that come in coarse steps, as drivers that cut to whole numbers make them.

    Args:
        name: name of the stream.
        values: samples, shape (n, m).
        channels: name of each column.
        unit: unit of the values.
    """
    parts = []
    for column, channel in zip(values.T, channels, strict=True):
        levels = np.unique(column[np.isfinite(column)])
        if not FEWEST_LEVELS <= len(levels) <= MOST_LEVELS:
            continue
        apart = np.diff(levels)
        step, rms = float(apart.min()), float(np.sqrt(np.nanmean(column**2)))
        even = bool(np.all(np.abs(apart / step - np.rint(apart / step)) < EVEN))
        if even and step > COARSE_STEP * rms:
            said = f"{step:.3g}{'' if unit == '1' else ' ' + unit}"
            parts.append(f"{channel} in steps of {said}, {100.0 * step / rms:.2g} % of its rms")
    if not parts:
        return []
    text = f"{name}: {'; '.join(parts)}: what acted may lie between, and small torques are wrong by up to a step"
    return [Notice(name, "coarse", len(parts), text)]


def _clipped(column: Array, extreme: float) -> int:
    """Number of samples on plateaus at the extreme that are entered or left at speed.

    A signal that turns around, or an encoder at rest, leaves its plateau quantum by quantum, slower than it
    typically moves.
    """
    steps = np.abs(np.diff(column))
    moving = steps[steps > 0]
    at_speed = max(1.5 * float(moving.min()), 0.3 * float(np.median(moving))) if len(moving) else np.inf
    at_extreme = column == extreme
    edges = np.flatnonzero(np.diff(at_extreme.astype(np.int8), prepend=0, append=0))
    count = 0
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        around = np.concatenate([steps[max(start - 2, 0) : start], steps[stop - 1 : stop + 1]])
        if stop - start >= CLIPPED_RUN and around.max(initial=0.0) > at_speed:
            count += int(stop - start)
    return count


def said_once(notices: Sequence[Notice]) -> list[Notice]:
    """The notices in which several streams say the same as one, under the names of all."""
    by_text: dict[str, list[Notice]] = {}
    for notice in notices:
        by_text.setdefault(notice.text.removeprefix(f"{notice.stream}: "), []).append(notice)
    found = []
    for text, same in by_text.items():
        names = ", ".join(dict.fromkeys(notice.stream for notice in same))
        found.append(same[0] if len(same) == 1 else replace(same[0], text=f"{names}: {text}"))
    return found
