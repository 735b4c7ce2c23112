# SPDX-License-Identifier: BSD-3-Clause
"""Stretches in which too little is known to ask the equations of motion to hold: they are left out.

That is so where all streams are silent, where the commands are (whatever acted then was not recorded), and where the
encoders are for long. Commands that are sent only when they change have no period, and are silent when nothing changes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Notice, Recording, Stream
from jointscope.tools.bags.clocks.durations import duration
from jointscope.tools.bags.tidying.stream_notices import timing

Stretch = tuple[float, float]

COMMAND_PERIODS, COMMAND_SECONDS = 5.0, 0.01  # [1], [s] a pause of the commands is longer than both
SENSOR_PERIODS, SENSOR_SECONDS = 20.0, 0.25  # [1], [s]
REGULAR = 0.5  # spread of the steps over their median, above which a stream has no period
SAID = 5  # stretches listed


def with_silences_left_out(recording: Recording, encoder: str) -> Recording:
    """The recording with its silences left out, and notices that say so.

    Args:
        recording: all streams on one time axis.
        encoder: name of the encoders' stream.
    """
    commands = _pauses(recording.command, COMMAND_PERIODS, COMMAND_SECONDS)
    if not _has_period(recording.command):
        commands = []
    sensors = _pauses(recording.streams[encoder], SENSOR_PERIODS, SENSOR_SECONDS)
    silent = _silent(recording.streams)
    stretches = merged([*commands, *sensors, *silent])
    if not stretches:
        return recording
    try:
        without = recording.leaving_out(stretches)
    except RecordingError:  # hardly anything would be left: such a recording is judged by what is there
        text = (
            f"samples are missing in most of the recording, for {duration(sum(t1 - t0 for t0, t1 in stretches))} in all"
        )
        return replace(recording, notices=[*recording.notices, Notice("recording", "gap", len(stretches), text)])
    said = [n for n in recording.notices if n.kind != "gap" or not _is_silence(recording.streams[n.stream], stretches)]
    return replace(without, notices=[*said, _notice(stretches, commands, sensors, silent)])


def _is_silence(stream: Stream, stretches: list[Stretch]) -> bool:
    """Whether the gaps of a stream are no others than those that are left out."""
    seen = timing(stream.times)
    at = seen.longest_gap_at + 0.5 * seen.longest_gap
    return seen.gaps <= len(stretches) and any(t0 <= at <= t1 for t0, t1 in stretches)


def _has_period(stream: Stream) -> bool:
    steps = np.diff(stream.times)
    if len(steps) < 10:
        return False
    middle = float(np.median(steps))
    return float(np.median(np.abs(steps - middle))) < REGULAR * middle and float(np.quantile(steps, 0.9)) < 3.0 * middle


def _pauses(stream: Stream, periods: float, seconds: float) -> list[Stretch]:
    """Steps between samples that are longer than usual ones [s]."""
    steps = np.diff(stream.times)
    if not len(steps):
        return []
    long = np.flatnonzero(steps > max(periods * float(np.median(steps)), seconds))
    return [(float(stream.times[k]), float(stream.times[k + 1])) for k in long]


def _silent(streams: Mapping[str, Stream]) -> list[Stretch]:
    """Stretches without a sample of any stream [s]."""
    times = np.unique(np.concatenate([stream.times for stream in streams.values()]))
    slowest = max((float(np.median(np.diff(s.times))) for s in streams.values() if len(s) > 1), default=0.0)
    steps = np.diff(times)
    long = np.flatnonzero(steps > max(COMMAND_PERIODS * slowest, COMMAND_SECONDS))
    return [(float(times[k]), float(times[k + 1])) for k in long]


def merged(stretches: list[Stretch]) -> list[Stretch]:
    """The same stretches in order, with those that overlap as one."""
    found: list[Stretch] = []
    for t0, t1 in sorted(stretches):
        if found and t0 <= found[-1][1]:
            found[-1] = (found[-1][0], max(t1, found[-1][1]))
        else:
            found.append((t0, t1))
    return found


def _notice(stretches: list[Stretch], commands: list[Stretch], sensors: list[Stretch], silent: list[Stretch]) -> Notice:
    parts = []
    for t0, t1 in stretches[:SAID]:
        middle = 0.5 * (t0 + t1)
        what = next(
            (
                word
                for word, some in (
                    ("nothing at all was recorded", silent),
                    ("no command", commands),
                    ("no encoder sample", sensors),
                )
                if any(a <= middle <= b for a, b in some)
            ),
            "samples are missing",
        )
        parts.append(f"{t0:.3f} to {t1:.3f} s ({what} for {duration(t1 - t0)})")
    more = f" and {len(stretches) - SAID} more" if len(stretches) > SAID else ""
    text = f"left out, as too little is known there: {', '.join(parts)}{more}; no equation of motion is asked to hold"
    return Notice("recording", "gap", len(stretches), text)
