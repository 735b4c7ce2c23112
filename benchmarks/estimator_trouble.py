# SPDX-License-Identifier: BSD-3-Clause
"""What becomes of the estimate when messages are lost and late, overtake each other, and a gyro is silent."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from estimator_case import Case, make_case
from estimator_consistency import BOUNDS, within
from estimator_run import Run, run
from message_feed import disturbed, in_order
from patience import say
from tables import Section, Table

LOST = 0.3  # of all messages, commands too
LATEST = 5e-3  # [s]
SILENT = ("imu2", 2.0, 7.0)  # stream, since, until [s]
FAR = 0.1  # [rad] link position error that is called divergence
BESIDE = 3  # recordings that are also run without trouble
HEAD = ("part of the recording", "NEES", "link velocity error", f"without trouble ({BESIDE} recordings)")


@dataclass(frozen=True)
class Outcome:
    """One run with trouble, and for some the same recording without."""

    troubled: Run
    untroubled: Run | None

    @property
    def diverged(self) -> bool:
        """Whether the estimate was lost at any time: not finite, far from the truth, or begun anew."""
        n = self.troubled.now.error.shape[1] // 4
        far = np.abs(self.troubled.now.error[:, :n]).max()
        return not bool(far < FAR) or self.troubled.estimator.status.restarts > 0


def run_section(quick: bool) -> Section:
    """20 recordings; `quick` takes two."""
    seeds = range(1, 3) if quick else range(1, 21)
    name, since, until = SILENT
    seconds = until + 1.0
    section = Section(
        "Estimator: trouble",
        f"{len(seeds)} recordings of {seconds:g} s as above, true parameters and matching noise; {LOST:.0%} of all "
        f"messages lost, commands too, the others up to {1000 * LATEST:g} ms late and out of order (stamps exact), and "
        f"{name} silent from {since:g} s to {until:g} s. The controller asks for the state every millisecond.",
    )
    outcomes = []
    for seed in seeds:
        say(f"trouble: seed {seed}")
        outcomes.append(_outcome(make_case(seed, seconds), seed, seed in seeds[:BESIDE]))
    _promise(section, outcomes)
    parts = {
        f"both gyros, until {since:g} s": (0.0, since),
        f"{name} silent, {since:g} s to {until:g} s": (since, until),
        f"{name} back, from {until:g} s": (until, seconds),
    }
    rows = [(words, *_cells(outcomes, *part)) for words, part in parts.items()]
    section.tables += [Table("Through the recording", HEAD, rows), _counts(outcomes)]
    return section


def _outcome(case: Case, seed: int, beside: bool) -> Outcome:
    messages = in_order(case.recording)
    rng = np.random.default_rng(seed)
    troubled = disturbed(messages, rng, lost=LOST, latest=LATEST, silent=SILENT)
    without = run(case, case.robot, messages, lagged_too=False) if beside else None
    return Outcome(run(case, case.robot, troubled, lagged_too=False), without)


def _promise(section: Section, outcomes: list[Outcome]) -> None:
    lost = sum(outcome.diverged for outcome in outcomes)
    section.promise("runs without divergence", "all", f"{len(outcomes) - lost} of {len(outcomes)}", lost == 0)
    nees = [float(outcome.troubled.now.nees.mean()) for outcome in outcomes]
    mean = float(np.mean(nees))
    measured = f"{mean:.3f} ({min(nees):.2f} to {max(nees):.2f})"
    section.promise("mean NEES of all runs (by seed)", f"{BOUNDS[0]:g} to {BOUNDS[1]:g}", measured, within(mean))
    nis = float(np.mean([outcome.troubled.nis_mean for outcome in outcomes]))
    section.promise("&nbsp;&nbsp;mean NIS", "", f"{nis:.3f}")
    took = 1e3 * np.concatenate([outcome.troubled.wall for outcome in outcomes])
    p50, p99 = np.quantile(took, [0.5, 0.99])
    section.promise("&nbsp;&nbsp;cycle, median; 99 of 100", "", f"{p50:.2f} ms; {p99:.2f} ms")
    section.numbers |= {"nees": nees, "nis": nis, "latency_ms": {"p50": p50, "p99": p99}}


def _cells(outcomes: list[Outcome], t0: float, t1: float) -> tuple[str, str, str]:
    troubled = [outcome.troubled.now.within(t0, t1) for outcome in outcomes]
    without = [outcome.untroubled.now.within(t0, t1) for outcome in outcomes if outcome.untroubled is not None]
    nees = float(np.mean(np.concatenate([part.nees for part in troubled])))
    errors = [np.concatenate([part.link_velocity_error for part in parts]) for parts in (troubled, without)]
    return f"{nees:.3f}", *(f"{1e3 * np.sqrt(np.mean(error**2)):.2f} mrad/s" for error in errors)


def _counts(outcomes: list[Outcome]) -> Table:
    """Of all runs together."""
    received, used, late, dropped = Counter[str](), Counter[str](), Counter[str](), dict[str, Counter[str]]()
    for outcome in outcomes:
        status = outcome.troubled.estimator.status
        received += status.received
        used += status.used
        late += status.late
        for stream, kinds in status.dropped.items():
            dropped.setdefault(stream, Counter()).update(kinds)
    rows = [
        (stream, f"{received[stream]:,}", f"{used[stream]:,}", f"{late[stream]:,}", _words(dropped.get(stream, {})))
        for stream in sorted(received)
    ]
    return Table("Messages of all runs", ("stream", "received", "used", "of these late", "not used"), rows)


def _words(kinds: Mapping[str, int]) -> str:
    return ", ".join(f"{count:,} {kind.replace('_', ' ')}" for kind, count in sorted(kinds.items()) if count) or "0"
