# SPDX-License-Identifier: BSD-3-Clause
"""Can the estimate of a replay be trusted? Checks with a sentence each, the headline, and what to type next."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointscope.graphs.fixed_lag.replay.nis_windows import nis_bounds
from jointscope.graphs.fixed_lag.replay.replay_result import InnovationSeries, ReplayResult
from jointscope.tools.presentation.numbers import percent, significant
from jointscope.tools.verdicts.judgement import LEVELS, Check, Judgement

NIS = (1.25, 2.0)  # per degree of freedom: fine up to the first, bad beyond the second
SMALL_NIS = (0.8, 0.4)  # below the first the sigmas are larger than they need be; a quantized encoder at rest is there
ANSWERS = {
    "good": "Yes: the estimate is as accurate as its sigmas say.",  # or better, which is a remark
    "warn": "With reservations: the sigmas do not hold everywhere.",
    "bad": "No: model and measurements contradict each other.",
}
TOO_SLOW = "This machine is too slow for the rate of the commands."
KINDS = {
    "too_late": "too late",
    "stuck": "stuck",
    "duplicate": "repeated",
    "not_finite": "not finite",
    "incomplete": "before those of all joints had arrived",
    "outlier": "outliers",
    "saturated": "saturated",
}


@dataclass(frozen=True)
class Suspect:
    """A sensor whose innovations are not as large as expected: worst channel, its NIS, number of alarms."""

    sensor: str
    channel: str
    nis: float
    alarms: int


def judge_replay(result: ReplayResult) -> Judgement:
    """Applies all checks; how fast this machine is says nothing about the estimate itself."""
    estimate = (_consistent(result), _samples(result), _lost(result), _agreement(result))
    speed = _in_time(result)
    found = Judgement.of(estimate, ANSWERS)
    level, answer = found.level, found.headline
    if speed.level == "warn":
        level, answer = max(level, "warn", key=LEVELS.index), f"{answer} {TOO_SLOW}"
    return Judgement(level, answer, (*estimate[:3], speed, estimate[3]))


def suspects(result: ReplayResult) -> list[Suspect]:
    """Sensors with an alarm, or with a mean NIS far above one; the worst first."""
    found = []
    for name, series in result.innovations.items():
        alarms = sum(n for source, n in result.alarms.items() if source == name or source in series.channels)
        alarmed = alarms or any(source == name or source in series.channels for source in result.status.alarms)
        known = {c: v for c, v in series.channel_nis.items() if np.isfinite(v)}
        if known and (alarmed or nis_level(series.nis_mean) == "bad"):
            channel = max(known, key=lambda c: known[c])
            found.append(Suspect(name, channel, known[channel], alarms))
    return sorted(found, key=lambda s: -s.nis)


def diagnose_command(result: ReplayResult) -> str:
    """The command that asks which effect is missing, for a shell."""
    robot = result.source.robot or result.robot.path.stem
    return f"jointscope diagnose {shlex.quote(robot)} {shlex.quote(result.source.path or 'BAG')}"


def dropped_words(result: ReplayResult) -> list[str]:
    """What was not used, by stream: "imu1: 12 of 6500 (10 repeated, 2 not finite)"."""
    status, words = result.status, []
    for name, kinds in status.dropped.items():
        count = sum(kinds.values())
        if count:
            told = ", ".join(f"{n} {KINDS.get(kind, kind)}" for kind, n in kinds.items() if n)
            words.append(f"{name}: {count} of {status.received.get(name, count)} ({told})")
    return words


def nis_level(nis: float) -> str:
    """How good a NIS per degree of freedom is."""
    if not np.isfinite(nis):
        return "info"
    if nis < SMALL_NIS[0]:
        return "info" if nis >= SMALL_NIS[1] else "warn"
    return "good" if nis <= NIS[0] else "warn" if nis <= NIS[1] else "bad"


def _consistent(result: ReplayResult) -> Check:
    name = "Residuals as large as expected"
    level, nis = nis_level(result.nis_mean), significant(result.nis_mean)
    for series in result.innovations.values():
        own = nis_level(series.nis_mean)
        worse = series.nis_mean > nis_bounds(series)[1] and LEVELS.index(own) > LEVELS.index(level)
        level = own if worse else level
    off = suspects(result)
    by_sensor = ", ".join(f"{n} {_with_bounds(s)}" for n, s in result.innovations.items())
    text = f"NIS per degree of freedom is {nis} (1 is expected): {by_sensor}."
    if off:
        worst = off[0]
        level = "bad" if nis_level(worst.nis) == "bad" else "warn"
        text += f" {worst.channel} stands out with {significant(worst.nis)}"
        text += f"; {worst.sensor} raised {worst.alarms} alarm{'s' * (worst.alarms != 1)}." if worst.alarms else "."
    elif level != "good" and np.isfinite(result.nis_mean):
        larger = "The noise is larger than stated, or the model misses something."
        text += f" {larger}" if result.nis_mean > 1.0 else ""
    small = [(n, s) for n, s in result.innovations.items() if s.nis_mean < min(SMALL_NIS[0], nis_bounds(s)[0])]
    if small:
        level = "info" if level == "good" else level
        text += f" {_too_wide(result, small)}"
    return Check(level, name, text)


def _with_bounds(series: InnovationSeries) -> str:
    """NIS of a sensor beside what chance allows."""
    low, high = nis_bounds(series)
    return f"{significant(series.nis_mean)} ({significant(low, 2)} to {significant(high, 2)} by chance)"


def _too_wide(result: ReplayResult, small: Sequence[tuple[str, InnovationSeries]]) -> str:
    """What sigmas that are wider than the errors mean, and what to do about them."""
    listed = ", ".join(
        f"{n} are {significant(1.0 / np.sqrt(max(s.nis_mean, 1e-6)), 2)} times as wide as its errors" for n, s in small
    )
    return (
        f"Sigmas of {listed}: the estimate is better than it says, and trusts that sensor less than it could. "
        f"Calibrate with `noise: {{estimate: true}}`, or give {' and '.join(f'sensors.{n}' for n, _ in small)} in "
        f"{result.robot.path.name} the sigma of its noise; one that is quantized and mostly at rest may stay so."
    )


def _samples(result: ReplayResult) -> Check:
    name = "Samples used"
    received = sum(result.status.received.values()) or 1
    late = sum(result.status.late.values())
    told = f"{late} came out of order and were put at their stamps. " if late else ""
    if not result.dropped:
        return Check("good", name, f"{told}All {received} messages were used.")
    share = result.dropped / received
    level = "info" if share < 0.01 else "warn"
    return Check(
        level, name, f"{told}{result.dropped} of {received} were left out: {'; '.join(dropped_words(result))}."
    )


def _lost(result: ReplayResult) -> Check:
    name = "Sensors and commands alive"
    lost = [e for e in result.events if e.kind in ("sensor_lost", "command_lost", "stuck", "gap", "restarted")]
    if not lost:
        return Check("good", name, "No stream fell silent.")
    told = "; ".join(f"{e.text} ({e.time:.2f} s)" for e in lost[:3])
    more = f"; and {len(lost) - 3} more" if len(lost) > 3 else ""
    return Check("info" if all(e.kind == "gap" for e in lost) else "warn", name, f"{told}{more}.")


def _in_time(result: ReplayResult) -> Check:
    name = "Fast enough"
    latency = result.latency
    period = result.recording_seconds / max(result.updates, 1)
    text = (
        f"An update took {significant(1e3 * latency.p50)} ms in the median, {significant(1e3 * latency.p99)} ms in 99 "
        f"of 100, {significant(1e3 * latency.max)} ms at most; one was due every {significant(1e3 * period)} ms."
    )
    level = "good" if latency.p99 <= period else "info" if latency.mean <= period else "warn"
    return Check(level, name, text)


def _agreement(result: ReplayResult) -> Check:
    name = "Agrees with the batch smoother"
    found = result.agreement
    if found is None:
        reason = result.no_agreement or "not compared; --batch does it"
        return Check("info", name, f"{reason.rstrip('.')}.")
    state, time, sigmas = found.worst
    if found.agrees:
        k = int(np.argmax(found.rms))
        text = f"All states at the lag are within {significant(found.rms[k])} sigma (rms, {found.names[k]})"
        return Check("good", name, f"{text}; at most {significant(sigmas)} sigma ({state} at {time:.2f} s).")
    apart = list(found.apart.items())
    told = ", ".join(f"{n} {significant(r)}" for n, r in apart[:3])
    more = f" and {len(apart) - 3} more" if len(apart) > 3 else ""
    far = f"{percent(float(found.far_share.max()))} of the ticks beyond 3 sigma"
    text = f"It does not: rms distance in sigmas {told}{more}, {far}; worst: {state}, {significant(sigmas)} sigma at"
    return Check("warn", name, f"{text} {time:.2f} s.")
