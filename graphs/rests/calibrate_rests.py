# SPDX-License-Identifier: BSD-3-Clause
"""Springs, friction bands and weights from rests alone, with sigmas; what rests say nothing of stays as it is.

The likeliest values (settling.py) are where the means and sigmas of the posterior (band_posterior.py) are looked for.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.calibration.calibration_result import ParameterEstimate
from jointscope.graphs.calibration.found_values import derived_results, dynamic_parameters
from jointscope.graphs.rest_sets.rest_errors import RestErrors, rest_errors
from jointscope.graphs.rest_sets.rest_set import EDGE, RestSet
from jointscope.graphs.rest_sets.settling import settled
from jointscope.graphs.rests.band_posterior import band_posterior
from jointscope.graphs.rests.doubts import AskedOfRests, Doubt
from jointscope.graphs.rests.followers import with_followers
from jointscope.graphs.rests.rests_by_values import SaidElsewhere
from jointscope.graphs.rests.seen_rests import SeenRests
from jointscope.graphs.rests.unheard_speeds import as_given, with_priors, without_motion
from jointscope.graphs.rests.unnoticed import Unnoticed, unnoticed
from jointscope.graphs.solving.batch_solver import Progress, Solution, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.graphs.solving.set_problem import SetProblem
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.graphs.starts.spring_knots import with_knots
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import with_sigmas
from jointscope.robots.rests.rests import Rests

Array = NDArray[np.float64]
EDGES = (1.0, 0.2, EDGE)  # of the friction: blur of the bands' edges, stage by stage
MOST_ITERATIONS = 150
RAN_AWAY = 10.0  # times what a band has held at most, from which it is no band of these rests
FEWEST_HELD = 4  # rests of a motor that had moved, for this
TOUCHED = 0.98  # of its prior's sigma: a value whose sigma stays above it was told nothing


@dataclass(frozen=True)
class RestCalibration:
    """Result of a calibration from rests.

    Attributes:
        robot: with the values that were found and their sigmas.
        likeliest: with the values of largest likelihood, masses and loads as they are said to be.
        start: before.
        problems: the rests of each recording, with their weights.
        states: where links and motors stand, shape (m, d) each.
        parameters: of which the rests say anything.
        derived: what follows from them.
        silent: names of the parameters of which they say nothing.
        covariance: of the values of all free parameters, shape (p, p).
        doubts: what would make the rests far likelier.
        unnoticed: how wrong masses and loads may be before they contradict.
        before, errors: of each recording, at the start values and at those found.
        iterations: of all stages.
        cost: at the end.
        wall_seconds: of the whole.
    """

    robot: Robot
    likeliest: Robot
    start: Robot
    problems: tuple[RestSet, ...]
    states: tuple[Array, ...]
    parameters: tuple[ParameterEstimate, ...]
    derived: tuple[ParameterEstimate, ...]
    silent: tuple[str, ...]
    covariance: Array
    doubts: tuple[Doubt, ...]
    unnoticed: tuple[Unnoticed, ...]
    before: RestErrors
    errors: RestErrors
    iterations: int
    cost: float
    wall_seconds: float

    @property
    def seen(self) -> SeenRests:
        """What the rests say, as a calibration with motion has it."""
        return SeenRests(
            self.robot, self.start, self.problems, self.parameters, self.errors, self.doubts, self.unnoticed
        )

    @property
    def sets(self) -> tuple[tuple[RestSet, Array], ...]:
        """The rests of each recording with their states, as a calibration with motion has them."""
        return tuple(zip(self.problems, self.states, strict=True))

    @property
    def count(self) -> int:
        """Number of rests."""
        return sum(len(problem.rests) for problem in self.problems)

    def to_json(self) -> dict[str, Any]:
        """The content of `--json`."""
        table = {p.name: {"value": p.value, "sigma": p.sigma, "unit": p.unit} for p in self.parameters}
        derived = {p.name: {"value": p.value, "sigma": p.sigma, "unit": p.unit, "derived": True} for p in self.derived}
        return {
            "converged": True,
            "iterations": self.iterations,
            "samples": sum(problem.measured for problem in self.problems),
            "rests": self.count,
            "wall_seconds": self.wall_seconds,
            "cost": self.cost,
            "parameters": table | derived,
            "undetermined": list(self.silent),
            "doubts": [{"label": d.label, "chi2_falls_by": d.fall, "p_value": d.p_value} for d in self.doubts],
            "unnoticed": {u.label: u.share if np.isfinite(u.share) else None for u in self.unnoticed},
            "repeatability": dict(zip(self.robot.joints, self.problems[0].repeatability.tolist(), strict=True)),
            "channels": self.errors.to_json(self.robot),
        }


@in_solver_context
def calibrate_rests(
    robot: Robot,
    recordings: Sequence[Rests],
    progress: Progress | None = None,
    near: RestSet | None = None,
    beside: Sequence[SetProblem] = (),
) -> RestCalibration:
    """Calibrates a robot from rests.

    Args:
        robot: with start values and priors.
        recordings: rests of each.
        progress: called with a text and the share done.
        near: rests with the weights to begin with, where the values of the robot are near the end.
        beside: recordings of kinds without states in the same graph, as those with locked springs.

    Raises:
        SolveError: no convergence.
    """
    began, report = time.perf_counter(), progress or (lambda text, share: None)
    given = with_knots(robot, recordings)
    robot, unheard = without_motion(given, recordings)
    problems, solution, iterations = settled_rests(robot, recordings, report, near, beside)
    x, likeliest = solution.estimate.states[0], solution.estimate.calibrations[0]
    whole = RestSet.joined(problems)
    said = _said_beside(whole, x, likeliest, beside, solution) if beside else None
    calibration, covariance = band_posterior(whole, robot, x, likeliest, said)
    calibration = calibration if beside else with_followers(whole, robot, x, likeliest, calibration)
    sigmas, scale = np.sqrt(np.diag(covariance)), calibration.value_by_coordinate
    table = dynamic_parameters(robot, calibration, sigmas)
    priors = np.array([robot.parameters[p.name].coordinate_sigma for p in table])
    told = [p for p, sigma, prior in zip(table, sigmas, priors, strict=True) if sigma < TOUCHED * prior]
    known = {p.name for p in told}
    of_likeliest = zip(likeliest.names, likeliest.values.tolist(), strict=True)
    peak = robot.with_values({name: value for name, value in of_likeliest if name in known})
    found = robot.with_values({p.name: p.value for p in told})
    found = replace(found, parameters=with_sigmas(found.parameters, {p.name: p.sigma for p in told}))
    peak, found = (as_given(each, given, unheard) for each in (peak, found))
    derived = [
        p for p, result in zip(derived_results(robot, calibration, covariance), robot.derived, strict=True)
        if set(result.of) <= known
    ]  # fmt: skip
    covariance = with_priors(covariance * np.outer(scale, scale), calibration.names, given)
    problems = [problem.of_robot(given) for problem in problems]
    asked = AskedOfRests.of(whole, robot, x, likeliest, said)
    report("done", 1.0)
    return RestCalibration(
        robot=found,
        likeliest=peak,
        start=given,
        problems=tuple(problems),
        states=states_of(problems, solution),
        parameters=tuple(told),
        derived=tuple(derived),
        silent=tuple(name for name in Calibration.of(given).names if name not in known),
        covariance=covariance,
        doubts=asked.doubts() if asked else (),
        unnoticed=unnoticed(asked, robot) if asked else (),
        before=rest_errors(problems),
        errors=rest_errors([problem.of_robot(found) for problem in problems]),
        iterations=iterations,
        cost=solution.cost,
        wall_seconds=time.perf_counter() - began,
    )


def _said_beside(
    whole: RestSet, x: Array, likeliest: Calibration, beside: Sequence[SetProblem], solution: Solution
) -> SaidElsewhere:
    """What the recordings beside and priors say of the values."""
    place = solution.shared.indices(0)[likeliest.columns[DYNAMICS]]
    covariance = np.asarray(posteriors([whole, *beside], solution)[1][np.ix_(place, place)])
    scale = likeliest.value_by_coordinate
    return SaidElsewhere.of(whole, x, likeliest, covariance * np.outer(scale, scale))


def settled_rests(
    robot: Robot,
    recordings: Sequence[Rests],
    report: Progress,
    near: RestSet | None = None,
    beside: Sequence[SetProblem] = (),
) -> tuple[list[RestSet], Solution, int]:
    """Rests with the weights that they deserve, the solution of all as one set, and the iterations that it took.

    Args:
        robot: with start values and priors.
        recordings: rests of each.
        report: called with a text and the share done.
        near: rests with the weights to begin with, where the values of the robot are near the end.
        beside: as of `calibrate_rests`.

    Raises:
        SolveError: no convergence, or a friction that ran away.
    """
    # springs that are far off make bands wide, which never come back; models that lack something step by the average
    attempts = ((False, False), (False, True), (True, False), (True, True))
    for scoring, links_first in attempts:
        try:
            return _settled(robot, recordings, report, near, links_first, scoring, beside)
        except SolveError:
            if (scoring, links_first) == attempts[-1]:
                raise
    raise AssertionError


def _settled(
    robot: Robot,
    recordings: Sequence[Rests],
    report: Progress,
    near: RestSet | None,
    links_first: bool,
    scoring: bool,
    beside: Sequence[SetProblem],
) -> tuple[list[RestSet], Solution, int]:
    """The same from one beginning: bands at once, or links in equilibrium before them."""
    problems = [replace(RestSet.of(robot, rests), scoring=scoring) for rests in recordings]
    if near is not None:
        weights = near.repeatability, near.per_command
        problems = [replace(problem, repeatability=weights[0], per_command=weights[1]) for problem in problems]
    whole, edges = RestSet.joined(problems), EDGES if near is None else EDGES[-1:]
    begun = [problem.start(Calibration.of(robot)) for problem in (whole, *beside)]
    estimate, iterations = Estimate(tuple(x for x, _ in begun), tuple(at for _, at in begun)), 0
    if links_first:
        nothing = np.zeros_like(whole.rests.creep)
        links = replace(whole, rests=replace(whole.rests, moved=nothing.astype(bool), creep=nothing))
        solution = solve([links, *beside], estimate, max_iterations=MOST_ITERATIONS)
        estimate, iterations = solution.estimate, len(solution.iterations)

    def converged(k: int, rests: RestSet, solution: Solution) -> None:
        report(f"rests, pass {k + 1}, cost {solution.cost:.6g}", min((k + 1) / 6.0, 0.95))
        if rests.edge == EDGE and not (solution.converged or solution.flat):  # blunt edges only lead there
            raise SolveError(
                f"no convergence after {len(solution.iterations)} iterations over "
                f"{len(rests.rests)} rests; loads, units, signs or names may be wrong: "
                "look at what `jointscope compare ROBOT --rests BAG` says"
            )

    found = settled(whole, estimate, MOST_ITERATIONS, edges, converged, beside)
    whole, solution = found.rests, found.solution
    check_bands(whole, solution.estimate.states[0], solution.estimate.calibrations[0])
    weighed = [replace(problem, repeatability=whole.repeatability, edge=whole.edge) for problem in problems]
    return weighed, solution, iterations + found.iterations


def check_bands(whole: RestSet, x: Array, calibration: Calibration) -> None:
    """Bands that are far wider than all that they ever held: there the likelihood hardly falls and nothing leads back.

    Args:
        whole: the rests.
        x: where links and motors stand, shape (m, d).
        calibration: values.

    Raises:
        SolveError: the friction of a joint ran away.
    """
    bands = whole.bands(x, whole.torques(x, calibration), calibration)
    held = np.where(whole.rests.moved, np.abs(bands.y), 0.0).max(axis=0, initial=0.0)
    usual = np.median(bands.half, axis=0)
    away = (np.sum(whole.rests.moved, axis=0) >= FEWEST_HELD) & (usual > RAN_AWAY * held)
    if away.any():
        j = int(np.argmax(away))
        raise SolveError(
            f"the friction of {whole.robot.joints[j]} ran away: it could hold {usual[j]:.3g} N m, and had to hold "
            f"{held[j]:.3g} N m at the most; gains or start values are far off: hold the gain of the drive if you know "
            "it (`fixed: true` with the value of the data sheet), else begin nearer"
        )


def states_of(problems: Sequence[RestSet], solution: Solution) -> tuple[Array, ...]:
    """The states of each recording in the solution of all as one set."""
    ends = np.cumsum([len(problem.rests) for problem in problems])[:-1]
    return tuple(np.split(solution.estimate.states[0], ends))
