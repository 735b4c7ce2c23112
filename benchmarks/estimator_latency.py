# SPDX-License-Identifier: BSD-3-Clause
"""How long an update of the estimator takes, now and after ten minutes, and how much memory it holds by then."""

from __future__ import annotations

import gc
import itertools
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from estimator_case import Case, make_case
from estimator_run import LAG, driven
from message_feed import Message, cycles, in_order
from numpy.typing import NDArray
from patience import say
from plain_smoother import PlainSmoother
from tables import Section, Table

from jointscope.graphs.fixed_lag import FixedLagEstimator
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

MEDIAN, TAIL = 0.5, 1.0  # [ms]
BEARING = 1.5  # times the plain robot
STEADY = 1.1  # last over first piece of a run; the motion differs a little
GROWTH = 0.05  # [MiB/min] of memory: three in an hour
SEED = 21
PIECE = 10.0  # [s] compared at the beginning and the end
PAUSE = 1.0  # [s] between repetitions of the recording, after which the estimator begins anew
TURN = 500  # cycles after which the robots take turns
BEGIN = 200  # cycles that do not count
MIB = 1024.0**2


@dataclass(frozen=True)
class Lap:
    """One repetition of the recording.

    Attributes:
        wall, cpu: time of every cycle, shape (m,) [s].
        memory: resident at the end [MiB].
    """

    wall: Array
    cpu: Array
    memory: float


def run_section(quick: bool, minutes: float) -> Section:
    """One long run in repetitions of a recording; `quick` takes short ones, for which memory is not judged."""
    length = 12.0 if quick else 60.0
    section = Section(
        "Estimator: time",
        f"1 kHz commands, encoders and two gyros; {LAG:g} s lag; one core, threads of the linear algebra limited to "
        "one. An update is one cycle of a controller: all messages of a tick fed, `state()` asked with its covariance. "
        "Python's garbage is collected and frozen once before the run.",
    )
    say(f"latency: simulating {length:g} s")
    case = make_case(SEED, length)
    count = 2 if quick else max(round(60.0 * minutes / length), 2)
    laps = list(_laps(case, count))
    _promise_speed(section, laps, length)
    _promise_steadiness(section, laps, length, quick)
    _promise_bearing(section, 4.0 if quick else 15.0)
    _compare_plain(section, case, 0.5 if quick else 1.5)
    return section


def _laps(case: Case, count: int) -> Iterator[Lap]:
    """The recording again and again with later and later stamps, through one estimator."""
    estimator, messages = FixedLagEstimator(case.robot, LAG), in_order(case.recording)
    length = messages[-1].stamp + PAUSE
    # filled before the run: what grows is the estimator's
    times = np.ones((count, sum(1 for _ in cycles(messages)) + 1, 2))
    gc.collect()
    gc.freeze()
    for lap, kept in enumerate(times):
        say(f"latency: {lap * length / 60.0:.1f} min of {count * length / 60.0:.1f} min")
        done = 0
        for cycle in driven(estimator, _shifted(messages, lap * length)):
            kept[done] = cycle.wall, cycle.cpu
            done += 1
        yield Lap(*kept[:done].T, _resident())


def _shifted(messages: list[Message], by: float) -> Iterator[Message]:
    return (m._replace(arrives=m.arrives + by, stamp=m.stamp + by) for m in messages)


def _promise_speed(section: Section, laps: list[Lap], length: float) -> None:
    wall, cpu = (1e3 * np.concatenate([lap[BEGIN:] for lap in times]) for times in _columns(laps))
    p50, p99 = np.quantile(wall, [0.5, 0.99])
    section.promise("update, median", f"at most {MEDIAN:g} ms", f"{p50:.3f} ms", p50 <= MEDIAN)
    section.promise("update, 99 of 100", f"at most {TAIL:g} ms", f"{p99:.3f} ms", p99 <= TAIL)
    section.promise("&nbsp;&nbsp;999 of 1000; slowest", "", f"{np.quantile(wall, 0.999):.2f} ms; {wall.max():.1f} ms")
    of_cpu = np.quantile(cpu, [0.5, 0.99])
    section.promise("&nbsp;&nbsp;CPU time: median; 99 of 100", "", "{:.3f} ms; {:.3f} ms".format(*of_cpu))
    total, recorded = sum(lap.wall.sum() for lap in laps), length * len(laps)
    section.promise(
        "replay", "faster than the recording", f"{recorded / total:.2f} times ({total:.0f} s)", total < recorded
    )
    section.numbers["latency_ms"] = {"p50": p50, "p99": p99, "max": wall.max(), "updates": len(wall)}
    section.numbers["cpu_ms"] = {"p50": of_cpu[0], "p99": of_cpu[1]}


def _columns(laps: list[Lap]) -> tuple[list[Array], list[Array]]:
    return [lap.wall for lap in laps], [lap.cpu for lap in laps]


def _promise_steadiness(section: Section, laps: list[Lap], length: float, quick: bool) -> None:
    """In CPU time: what else the machine does is not the estimator's."""
    piece = round(min(PIECE, length / 3.0) * 1000)
    first, last = laps[0].cpu, laps[-1].cpu
    within = np.median(first[-piece:]) / np.median(first[BEGIN:piece])
    across = np.median(last) / np.median(first)
    minutes = len(laps) * length / 60.0
    what = f"median update (CPU), last {piece / 1000:g} s of {length:g} s over the first"
    section.promise(what, f"at most {STEADY:g}", f"{within:.3f}", within <= STEADY)
    what = f"the same {length:g} s (CPU), after {minutes:.1f} min over the first time"
    section.promise(what, f"at most {STEADY:g}", f"{across:.3f}", across <= STEADY)
    # the first lap fills all windows, histories and caches
    growth = (laps[-1].memory - laps[0].memory) / max((len(laps) - 1) * length / 60.0, 1e-9)
    section.promise(
        f"growth of memory between {length:g} s and {minutes:.1f} min",
        "" if quick else f"at most {GROWTH:g} MiB/min",
        f"{growth:.3f} MiB/min ({laps[0].memory:.0f} to {laps[-1].memory:.0f} MiB)",
        None if quick else growth <= GROWTH,
    )
    section.numbers["memory_mib"] = [lap.memory for lap in laps]
    section.numbers["median_cpu_ms_by_lap"] = [1e3 * float(np.median(lap.cpu)) for lap in laps]
    section.notes.append(
        f"The long run repeats one recording of {length:g} s with later stamps; a pause of {PAUSE:g} s lies between, "
        "after which the estimator begins anew."
    )


def _promise_bearing(section: Section, seconds: float) -> None:
    """Both robots in turns, so that whatever else the machine does hits both."""
    say("latency: with and without bearing")
    cases = [make_case(SEED, seconds), make_case(SEED, seconds, effects=("bearing_flexibility@joint1",))]
    runs = [driven(FixedLagEstimator(case.robot, LAG), in_order(case.recording)) for case in cases]
    taken: list[list[float]] = [[], []]  # CPU time
    gc.collect()
    gc.freeze()
    for _ in range(0, round(seconds * 1000), TURN):
        for own, times in zip(runs, taken, strict=True):
            times.extend(cycle.cpu for cycle in itertools.islice(own, TURN))
    gc.unfreeze()
    plain, bearing = (1e3 * np.quantile(times[BEGIN:], [0.5, 0.99]) for times in taken)
    sizes = " against ".join(str(case.robot.layout.size) for case in reversed(cases))
    for i, words in enumerate(("median", "99 of 100")):
        ratio = bearing[i] / plain[i]
        what = f"with a soft bearing ({sizes} states, CPU), {words}"
        measured = f"{ratio:.2f} times ({bearing[i]:.3f} ms against {plain[i]:.3f} ms)"
        section.promise(what, f"at most {BEARING:g} times", measured, ratio <= BEARING)


def _compare_plain(section: Section, case: Case, seconds: float) -> None:
    """GTSAM's smoother without this project's window."""
    say("latency: one custom factor in Python for every sample")
    piece = _beginning(case.recording, seconds)
    ours = driven(FixedLagEstimator(case.robot, LAG), in_order(piece))
    plain = PlainSmoother(case.robot, piece, LAG)
    gc.collect()
    gc.freeze()
    times = {
        "FixedLagEstimator": np.array([cycle.wall for cycle in ours]),
        "IncrementalFixedLagSmoother with a CustomFactor in Python per sample": plain.seconds(),
    }
    gc.unfreeze()
    rows = []
    for words, taken in times.items():
        p50, p99 = 1e3 * np.quantile(taken[BEGIN:], [0.5, 0.99])
        rows.append((words, f"{p50:.2f} ms", f"{p99:.2f} ms", f"{taken[BEGIN:].mean() / 1e-3:.2f}"))
        section.numbers[words] = {"p50": p50, "p99": p99}
    head = ("smoother", "median", "99 of 100", "seconds per second of recording")
    section.tables.append(Table(f"GTSAM's smoother as it stands, {seconds:g} s at 1 kHz, {LAG:g} s lag", head, rows))


def _beginning(recording: Recording, seconds: float) -> Recording:
    streams = {name: stream.between(0.0, seconds) for name, stream in recording.streams.items()}
    return replace(recording, streams=streams)


def _resident() -> float:
    """Memory of this process that is in use now [MiB]; NaN where the system does not tell."""
    statm = Path("/proc/self/statm")
    if not statm.is_file():
        return float("nan")
    return int(statm.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / MIB
