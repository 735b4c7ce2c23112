# SPDX-License-Identifier: BSD-3-Clause
"""Whether the estimator's covariance tells the truth: normalised errors and innovations over many recordings."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from estimator_case import TORQUE, TRAINING, calibrated_robot, make_case
from estimator_run import LAG, Run, run
from message_feed import in_order
from patience import say
from tables import Section, Table, answer

from jointscope.robots.model.robot import Robot

BOUNDS = (0.8, 1.25)  # per degree of freedom
CORRELATED = (0.02, 0.1)  # [s]
HEAD = ("robot and disturbance", "seeds", "NEES now", f"NEES {LAG:g} s later", "NIS", "NEES by seed", "met?")


@dataclass
class Tally:
    """Sums over recordings.

    Attributes:
        nees, lagged, nis: mean of each recording, per degree of freedom.
    """

    nees: list[float]
    lagged: list[float]
    nis: list[float]

    @staticmethod
    def of(runs: Iterable[Run]) -> Tally:
        """Counts runs, of which none is kept."""
        tally = Tally([], [], [])
        for found in runs:
            tally.nees.append(float(found.now.nees.mean()))
            tally.lagged.append(float(found.lagged.nees.mean()))
            tally.nis.append(found.nis_mean)
        return tally


def run_section(quick: bool) -> Section:
    """20 recordings with the true robot and with a calibrated one; `quick` takes two."""
    seeds, few = (range(1, 3), range(1, 2)) if quick else (range(1, 21), range(1, 6))
    seconds = 3.0 if quick else 6.0
    section = Section(
        "Estimator: consistency",
        f"Recordings of {seconds:g} s of moves, each with a seed of its own, random torques of {TORQUE:g} N m on links "
        "and rotors. NEES is the normalised error squared of positions and velocities of links and motors, NIS that of "
        "all innovations, both per degree of freedom; 1 is right.",
    )
    say("consistency: calibrating")
    calibrated = calibrated_robot()
    learned = f"calibrated on {TRAINING:g} s, noise included"
    settings: list[tuple[str, Robot | None, float, range]] = [
        ("true parameters, matching noise", None, 0.0, seeds),
        (learned, calibrated, 0.0, seeds),
    ]
    settings += [(learned, calibrated_robot(correlation), correlation, few) for correlation in CORRELATED]
    rows = []
    for words, robot, correlation, chosen in settings:
        tally = Tally.of(_runs(words, robot, correlation, chosen, seconds))
        torques = f"correlated over {1000 * correlation:g} ms" if correlation else "new each ms"
        rows.append(_row(f"{words}; torques {torques}", tally))
        section.numbers[f"{words}; {torques}"] = {"nees": tally.nees, "lagged_nees": tally.lagged, "nis": tally.nis}
        for name, values in (("NEES", tally.nees), ("NIS", tally.nis)):
            mean = float(np.mean(values))
            what = f"{words}, torques {torques}: mean {name} of {len(chosen)} seeds"
            section.promise(what, f"{BOUNDS[0]:g} to {BOUNDS[1]:g}", f"{mean:.3f}", within(mean))
    section.tables.append(Table("Normalised squares", HEAD, rows))
    return section


def within(mean: float) -> bool:
    """Whether a normalised square is in its bounds."""
    return BOUNDS[0] <= mean <= BOUNDS[1]


def _runs(words: str, robot: Robot | None, correlation: float, seeds: range, seconds: float) -> Iterable[Run]:
    for seed in seeds:
        say(f"consistency: {words}, seed {seed}")
        case = make_case(seed, seconds, correlation_time=correlation)
        yield run(case, robot or case.robot, in_order(case.recording))


def _row(words: str, tally: Tally) -> tuple[str, ...]:
    nees, lagged, nis = (float(np.mean(values)) for values in (tally.nees, tally.lagged, tally.nis))
    spread = f"{min(tally.nees):.2f} to {max(tally.nees):.2f}"
    met = answer(within(nees) and within(nis))
    return (words, str(len(tally.nees)), f"{nees:.3f}", f"{lagged:.3f}", f"{nis:.3f}", spread, met)
