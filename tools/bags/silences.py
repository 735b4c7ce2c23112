# SPDX-License-Identifier: BSD-3-Clause
"""Stretches in which too little is known to ask the equations of motion to hold: they are left out.

That is so where all streams are silent, where the commands are (whatever acted then was not recorded), and where the
encoders are for long. Commands that are sent only when they change have no period, and are silent when nothing changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import (
    COMMAND_PERIODS,
    COMMAND_SECONDS,
    Notice,
    Recording,
    Stream,
    unknown_commands,
)
from jointscope.tools.bags.clocks.durations import duration
from jointscope.tools.bags.tidying.stream_notices import timing

Stretch = tuple[float, float]

SENSOR_PERIODS, SENSOR_SECONDS = 20.0, 0.25  # [1], [s]
SAID = 5  # stretches listed


def with_silences_left_out(recording: Recording, encoder: str) -> Recording:
    """The recording with its silences left out, at the ends cut off, and notices that say so.

    Args:
        recording: all streams on one time axis.
        encoder: name of the encoders' stream.
    """
    commands = _by_stretch(recording.command, unknown_commands(recording.command))
    sensors = _by_stretch(positions := recording.streams[encoder], positions.silences(SENSOR_PERIODS, SENSOR_SECONDS))
    silent = _silent(recording.streams)
    stretches = merged([*commands, *sensors, *silent])
    if not stretches:
        return recording
    try:
        without = recording.leaving_out(stretches).between(*_all_speak(recording, encoder, [*commands, *sensors]))
    except RecordingError:  # hardly anything would be left: such a recording is judged by what is there
        text = (
            f"samples are missing in most of the recording, for {duration(sum(t1 - t0 for t0, t1 in stretches))} in all"
        )
        return replace(recording, notices=[*recording.notices, Notice("recording", "gap", len(stretches), text)])
    said = [n for n in recording.notices if n.kind != "gap" or not _is_silence(recording.streams[n.stream], stretches)]
    return replace(without, notices=[*said, _notice(stretches, commands, sensors, silent)])


def _all_speak(recording: Recording, encoder: str, stretches: Sequence[Stretch]) -> Stretch:
    """From when until when all drivers of one topic speak [s]: one may begin late or end early."""
    begin, end = -np.inf, np.inf
    for stream in (recording.command, recording.streams[encoder]):
        first, last = float(stream.times[0]), float(stream.times[-1])
        for k in range(len(stream.channels)):
            own = stream.channel(k).times
            if len(own) and first < own[0] and (first, own[0]) in stretches:
                begin = max(begin, float(own[0]))
            if len(own) and own[-1] < last and (own[-1], last) in stretches:
                end = min(end, float(own[-1]))
    return begin, float(np.nextafter(end, np.inf))


def _is_silence(stream: Stream, stretches: list[Stretch]) -> bool:
    """Whether the gaps of a stream are no others than those that are left out."""
    seen = timing(stream.times)
    at = seen.longest_gap_at + 0.5 * seen.longest_gap
    return seen.gaps <= len(stretches) and any(t0 <= at <= t1 for t0, t1 in stretches)


def _by_stretch(stream: Stream, silences: Mapping[int, list[Stretch]]) -> dict[Stretch, str]:
    """Whose samples are missing in each stretch: " of elbow", or nothing where those of all channels are."""
    channels: dict[Stretch, list[int]] = {}
    for k, stretches in silences.items():
        for stretch in stretches:
            channels.setdefault(stretch, []).append(k)
    names = {stretch: [stream.channels[k].rpartition(".")[0] for k in some] for stretch, some in channels.items()}
    return {at: "" if len(own) == len(stream.channels) else f" of {', '.join(own)}" for at, own in names.items()}


def _silent(streams: Mapping[str, Stream]) -> list[Stretch]:
    """Stretches without a sample of any stream [s]."""
    times = np.unique(np.concatenate([stream.times for stream in streams.values()]))
    slowest = max(_slowest(stream) for stream in streams.values())
    steps = np.diff(times)
    long = np.flatnonzero(steps > max(COMMAND_PERIODS * slowest, COMMAND_SECONDS))
    return [(float(times[k]), float(times[k + 1])) for k in long]


def _slowest(stream: Stream) -> float:
    """Period of the slowest channel that has one [s]."""
    return float(np.max(stream.periods[np.isfinite(stream.periods)], initial=0.0))


def merged(stretches: list[Stretch]) -> list[Stretch]:
    """The same stretches in order, with those that overlap as one."""
    found: list[Stretch] = []
    for t0, t1 in sorted(stretches):
        if found and t0 <= found[-1][1]:
            found[-1] = (found[-1][0], max(t1, found[-1][1]))
        else:
            found.append((t0, t1))
    return found


def _notice(
    stretches: list[Stretch], commands: Mapping[Stretch, str], sensors: Mapping[Stretch, str], silent: list[Stretch]
) -> Notice:
    parts = []
    for t0, t1 in stretches[:SAID]:
        middle = 0.5 * (t0 + t1)
        reasons = (
            *((at, "nothing at all was recorded") for at in silent),
            *((at, f"no command{whose}") for at, whose in commands.items()),
            *((at, f"no encoder sample{whose}") for at, whose in sensors.items()),
        )
        what = next((why for (a, b), why in reasons if a <= middle <= b), "samples are missing")
        parts.append(f"{t0:.3f} to {t1:.3f} s ({what} for {duration(t1 - t0)})")
    more = f" and {len(stretches) - SAID} more" if len(stretches) > SAID else ""
    text = f"left out, as too little is known there: {', '.join(parts)}{more}; no equation of motion is asked to hold"
    return Notice("recording", "gap", len(stretches), text)
