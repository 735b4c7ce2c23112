# SPDX-License-Identifier: BSD-3-Clause
"""Batch calibration of a robot with free links: sizes of its effects and mountings of its gyros, with uncertainties."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.calibrate import check_recordings
from jointscope.graphs.calibration.calibration_result import BagFit, CalibrationResult, ChannelFit
from jointscope.graphs.calibration.calibration_summary import calibrated_robot, parameter_table, shared_names
from jointscope.graphs.calibration.failures_with_notices import names_notices
from jointscope.graphs.calibration.findings import findings
from jointscope.graphs.calibration.identifiability import weak_directions
from jointscope.graphs.calibration.stages.history import IterationRecord
from jointscope.graphs.calibration.stages.residual_series import ResidualSeries
from jointscope.graphs.noise.robust_sigma import FEWEST_BLOCKS, BlockScores, inflation
from jointscope.graphs.solving.batch_solver import Progress, Solution, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.graphs.transmission.free_links import EquationRows, FreeLinks
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]
MOST_ITERATIONS = 100


@in_solver_context
@names_notices
def calibrate_links(
    robot: Robot, recordings: Sequence[Recording], *, progress: Progress | None = None
) -> CalibrationResult:
    """Calibrates a robot with free links; arguments, result and errors as of `calibrate`."""
    began, report = time.perf_counter(), progress or (lambda text, share: None)
    notices = check_recordings(robot, recordings, every_joint=False)
    report("sensors against each other", 0.0)
    problems = FreeLinks.of(robot, recordings)
    solution = solved(problems)
    _, covariance = posteriors(problems, solution)
    calibrations = solution.estimate.calibrations
    each = [problem.rows(calibration) for problem, calibration in zip(problems, calibrations, strict=True)]
    factor = inflation([_scores(rows, solution, i) for i, rows in enumerate(each)], covariance)
    covariance = covariance * np.outer(factor, factor)
    sigmas, shared, first = np.sqrt(np.diag(covariance)), solution.shared, calibrations[0]
    names = shared_names(calibrations, shared)
    parameters = parameter_table(robot, first, sigmas, shared)
    found = calibrated_robot(robot, parameters, first, robot, robot.noise)
    bags = tuple(_bag_fit(*pair) for pair in zip(problems, calibrations, each, strict=True))
    result = CalibrationResult(
        robot=found.locked_as_in(recordings[0].posture),
        start=robot,
        bags=bags,
        parameters=parameters,
        names=names,
        correlation=covariance / np.maximum(np.outer(sigmas, sigmas), 1e-300),
        weak_directions=weak_directions(robot, first, shared, covariance),
        channels=_channels(each),
        noise=robot.noise,
        sigma_inflation=dict(zip(names, map(float, factor), strict=True)),
        iterations=tuple(
            IterationRecord("all samples", i.cost_after, i.damping, i.step_in_sigmas) for i in solution.iterations
        ),
        cost=solution.cost,
        samples=sum(problem.measured for problem in problems),
        recording_seconds=sum(recording.duration for recording in recordings),
        wall_seconds=time.perf_counter() - began,
    )
    report("done", 1.0)
    return replace(result, findings=findings(result, notices))


def solved(problems: Sequence[FreeLinks], hold: Sequence[str] = ()) -> Solution:
    """The minimum from the values of the robot.

    Raises:
        SolveError: no convergence.
    """
    starts = [problem.start(Calibration.of(problem.robot)) for problem in problems]
    estimate = Estimate(tuple(x for x, _ in starts), tuple(c for _, c in starts))
    solution = solve(problems, estimate, max_iterations=MOST_ITERATIONS, hold=hold)
    if not (solution.converged or solution.flat):
        raise SolveError(
            f"no convergence after {len(solution.iterations)} iterations: sizes may be far off, or an effect may have "
            "nothing to explain; take effects out with `jointscope remove`, or look with `jointscope diagnose`"
        )
    return solution


def _scores(rows: Sequence[EquationRows], solution: Solution, i: int) -> BlockScores:
    """What blocks of a recording say one by one: few and long ones, for what bends or is late does so for seconds."""
    first, last = (f(f(r.equation.times) for r in rows if len(r.equation.times)) for f in (min, max))
    shared = solution.shared
    scores = BlockScores(first, last, shared.indices(i), shared.size, (last - first) / FEWEST_BLOCKS)
    for r in rows:
        scores.add(r.equation.times, r.residual, r.by_shared / r.equation.sigma)
    return scores


def _bag_fit(problem: FreeLinks, calibration: Calibration, rows: Sequence[EquationRows]) -> BagFit:
    times, nothing = problem.signals.times, np.zeros((0, 0))
    residuals = {r.equation.name: _series(r) for r in rows}
    return BagFit(problem.recording, calibration, times, nothing, nothing, nothing, residuals, nothing, nothing)


def _series(rows: EquationRows) -> ResidualSeries:
    e = rows.equation
    sigma = np.full_like(e.measured, e.sigma)
    chi2 = np.mean(rows.residual**2, axis=0)
    units = (e.unit,) * len(e.channels)
    return ResidualSeries(e.channels, units, e.times, e.measured, rows.predicted, sigma, chi2)


def _channels(each: Sequence[Sequence[EquationRows]]) -> dict[str, ChannelFit]:
    """Fit per channel over all recordings."""
    found = {}
    for recordings in zip(*each, strict=True):
        e, left = recordings[0].equation, np.concatenate([rows.residual for rows in recordings])
        for channel, chi2 in zip(e.channels, np.mean(left**2, axis=0), strict=True):
            found[channel] = ChannelFit(float(np.sqrt(chi2)) * e.sigma, e.sigma, float(chi2), e.unit)
    return found
