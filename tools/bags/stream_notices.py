# SPDX-License-Identifier: BSD-3-Clause
"""What looks odd in a stream without being wrong: gaps, jitter, clipping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recording import Notice

Array = NDArray[np.float64]

GAP_PERIODS = 1.5  # a step longer than this many median periods, plus six times their spread, misses samples
JITTER_SHARE = 0.02  # of the median period
CLIPPED_RUN = 3  # equal extreme samples in a row
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
    """Notices about gaps and jitter of a stream with these times, shape (n,) [s]."""
    seen, notices = timing(times), []
    if seen.gaps:
        text = (
            f"{name}: {seen.gaps} gap{'s' * (seen.gaps > 1)}, about {seen.missing} samples missing; "
            f"the longest is {seen.longest_gap:.4g} s at {seen.longest_gap_at:.3f} s"
        )
        notices.append(Notice(name, "gap", seen.gaps, text))
    if seen.jitter > JITTER_SHARE * seen.period:
        text = (
            f"{name}: the period is {1e3 * seen.period:.4g} ms with a jitter of {1e3 * seen.jitter:.3g} ms "
            f"({seen.irregular} steps differ by more than 2 %)"
        )
        notices.append(Notice(name, "jitter", seen.irregular, text))
    return notices


def clipping_notices(name: str, values: Array, channels: tuple[str, ...], unit: str) -> list[Notice]:
    """A notice about channels that stay at exactly their extreme value while they move.

    Args:
        name: name of the stream.
        values: samples, shape (n, m); a channel with NaN or infinite values is left out.
        channels: name of each column.
        unit: unit of the values.
    """
    parts, total = [], 0
    for column, channel in zip(values.T, channels, strict=True):
        for extreme in (column.min(), column.max()) if np.isfinite(column).all() else ():
            count = _clipped(column, extreme) if extreme else 0  # a command of zero is rest
            if count >= CLIPPED_COUNT:
                parts.append(f"{channel} at {extreme:.6g}{'' if unit == '1' else ' ' + unit} in {count} samples")
                total += count
    return [Notice(name, "clipping", total, f"{name} stays at a limit while it moves: {'; '.join(parts)}")] * bool(
        parts
    )


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
