# SPDX-License-Identifier: BSD-3-Clause
"""Do 2 sigma intervals hold the truth? Many simulated robots under random torques that no model contains.

Every recording is another robot on another occasion: mounting, biases, start, targets and noise differ. The engine
that makes the recordings shares no formula with the estimator.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from deviations import Deviation, deviations
from patience import say
from tables import Section, Table

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.errors import JointscopeError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator import Disturbance, simulate

SERIES = {
    "white torque": Disturbance(link=0.5, motor=0.5),
    "20 ms Gauss-Markov torque": Disturbance(link=0.5, motor=0.5, correlation_time=0.02),
    "100 ms Gauss-Markov torque": Disturbance(link=0.5, motor=0.5, correlation_time=0.1),
}
LOWEST, HIGHEST = 0.90, 0.98
FIRST_SEED, FIRST_HARDWARE_SEED = 100, 500
KINDS = {"dynamics": "dynamics parameters", "bias": "gyro biases", "rotation": "mounting rotations"}


@dataclass(frozen=True)
class Outcome:
    """One calibration beside its truth.

    Attributes:
        deviations: all numbers with their claimed sigmas.
        inflation: by name, the factor that the block-robust sigma has over that of white noise.
    """

    deviations: list[Deviation]
    inflation: dict[str, float]


def run(quick: bool) -> Section:
    """Counts, over all kinds of disturbance, how often the truth lies within 2 sigma."""
    count, seconds = (4, 8.0) if quick else (20, 20.0)
    section = Section(
        "Honest sigmas",
        f"{count} simulated recordings of {seconds:g} s per series, random torques of 0.5 N m rms on every link and "
        "every motor, smooth friction, start values of the robot file (off by 10 to 480 %). Counted: 12 dynamics "
        "parameters, 6 biases, 5 observable rotation components of each recording. 95.4 % would be exact.",
    )
    robot = load_robot("doggy")
    for name, disturbance in SERIES.items():
        outcomes, failures = _series(robot, name, disturbance, count, seconds)
        section.notes += failures
        if outcomes:
            _report(section, name, outcomes, judged=not quick)
    if quick:
        section.notes.append("Quick run: too few recordings for a verdict.")
    return section


def _series(
    robot: Robot, name: str, disturbance: Disturbance, count: int, seconds: float
) -> tuple[list[Outcome], list[str]]:
    """All calibrations of one kind of disturbance, and what failed."""
    outcomes, failures = [], []
    for i in range(count):
        say(f"honest sigmas: {name}, recording {i + 1} of {count}")
        simulation = simulate(
            robot,
            "calibration",
            seconds,
            seed=FIRST_SEED + i,
            hardware_seed=FIRST_HARDWARE_SEED + i,
            friction="smooth",
            quantized=False,
            disturbance=disturbance,
        )
        try:
            result = calibrate(robot, [simulation.recording])
        except JointscopeError as err:
            failures.append(f"{name}, recording {i + 1}: {err}")
            continue
        found = deviations(result.robot, simulation.truth["parameters"])
        outcomes.append(Outcome(found, result.sigma_inflation))
    return outcomes, failures


def _report(section: Section, name: str, outcomes: Sequence[Outcome], judged: bool) -> None:
    """Share within 2 sigma in all and by kind, then every number."""
    names = [d.name for d in outcomes[0].deviations]
    kinds = np.array([d.kind for d in outcomes[0].deviations])
    z = np.array([[d.z for d in outcome.deviations] for outcome in outcomes])
    inflation = np.array([[outcome.inflation[n] for n in names] for outcome in outcomes])
    within = np.abs(z) < 2.0
    share = float(within.mean())
    target = f"{100 * LOWEST:.0f} to {100 * HIGHEST:.0f} %"
    measured = f"{100 * share:.1f} % of {within.size}"
    section.promise(f"within 2 sigma, {name}", target, measured, LOWEST <= share <= HIGHEST if judged else None)
    for kind, words in KINDS.items():
        part = within[:, kinds == kind]
        section.promise(f"&nbsp;&nbsp;{words}", "", f"{100 * part.mean():.1f} % of {part.size}")
    plain = float((np.abs(z * inflation) < 2.0).mean())
    section.promise("&nbsp;&nbsp;with sigmas of white noise (not what is reported)", "", f"{100 * plain:.1f} %")
    rms = np.sqrt(np.mean(z**2, axis=0))
    rows = [
        (
            n,
            f"{within[:, j].sum()} of {len(outcomes)}",
            f"{rms[j]:.2f}",
            f"{z[:, j].mean():+.2f}",
            f"{inflation[:, j].mean():.2f}",
        )
        for j, n in enumerate(names)
    ]
    head = ("number", "within 2 sigma", "rms of z", "mean of z", "mean inflation")
    section.tables.append(Table(f"{name}: z = (estimate - truth) / sigma", head, rows))
    by_name = {n: {"z": z[:, j].tolist(), "inflation": inflation[:, j].tolist()} for j, n in enumerate(names)}
    section.numbers[name] = {"share_within_2_sigma": share, "share_with_white_sigmas": plain, "numbers": by_name}
