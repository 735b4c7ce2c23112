# SPDX-License-Identifier: BSD-3-Clause
"""Frequency responses in one graph with recordings of motion (and with rests), and whether they agree.

The stages of the responses lead to their Gaussian factor, which holds what is in doubt about them; it stands in the
graph of the motion. It was linearised where the responses alone have their values: where all kinds together have
others, its poses are linearised there, and the graph is solved again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.calibration.stages.near_solution import NearSolution
from jointscope.graphs.frequency.agreement import Agreement, agreement
from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
from jointscope.graphs.frequency.frequency_summary import FrequencySummary
from jointscope.graphs.frequency.stages import next_stage
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.graphs.solving.set_problem import SetProblem
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.recordings.signals import Excitation, Signals

Array = NDArray[np.float64]
MOST_PASSES = 3
AGREES = 0.1  # [sigma] that no value may move any more


def calibrate_beside_motion(
    robot: Robot,
    recordings: Sequence[Recording],
    shaken: Sequence[tuple[Signals, Excitation]],
    sets: Sequence[SetProblem] = (),
    progress: Progress | None = None,
    **options: Any,
) -> CalibrationResult:
    """Calibrates a robot from motion and frequency responses; each value that both tell has one sigma.

    Args:
        robot: with all that motion needs, and a section `frequency`.
        recordings: of motion.
        shaken: as of `calibrate_frequency`.
        sets: recordings of further kinds, as rests.
        progress: called with a text and the share done.
        options: as of `calibrate`.

    Raises:
        JointscopeError: as of `calibrate` and `calibrate_frequency`.
    """
    began, report = time.perf_counter(), progress or (lambda text, share: None)
    close = options.get("near") is not None
    alone = calibrate_frequency(
        robot, shaken, lambda text, share: report(f"responses: {text}", 0.2 * share), close, complete=not close
    )
    summary = alone.summary.without_friction()
    for _ in range(MOST_PASSES):
        result = calibrate(robot, recordings, sets=[*sets, summary], progress=report, **options)
        there = summary_at(summary, result.robot).without_friction()
        at, C, _ = coordinates_told(result, summary.names)
        if moved(at, C, summary, there) < AGREES:
            break
        summary = there
        if close:
            robot, options = _from_there(robot, result), {**options, "near": _near(result, options["near"])}
    return replace(result, wall_seconds=time.perf_counter() - began)


def _from_there(robot: Robot, result: CalibrationResult) -> Robot:
    """The robot with the values and the noise that were found."""
    return replace(_of_names(robot, result.robot, result.bags[0].calibration.names), noise=result.noise)


def _near(result: CalibrationResult, before: NearSolution) -> NearSolution:
    """Where a calibration ended, for the next one."""
    bags = result.bags
    return replace(before, calibrations=[bag.calibration for bag in bags], states=[bag.states for bag in bags])


def summary_at(summary: FrequencySummary, robot: Robot) -> FrequencySummary:
    """The same responses as a factor that is linearised at the values of a robot, of the same parameters."""
    problems = [problem.of_robot(_of_names(problem.robot, robot, summary.names)) for problem in summary.problems]
    calibration = Calibration.of(problems[0].robot).only([DYNAMICS])
    stages = [next_stage(problem, calibration) for problem in problems]
    return FrequencySummary.of(stages, calibration)


def moved(at: Array, C: Array, summary: FrequencySummary, there: FrequencySummary) -> float:
    """How far the values of all kinds would go if the factor were the one that was found there, largest in sigmas.

    Args:
        at: coordinates of the factor's values that all kinds have, shape (p,).
        C: their covariance, shape (p, p).
        summary: the factor that all kinds had.
        there: the one that was found at these values.
    """
    pull = [one.information @ (one.preferred - at) for one in (summary, there)]
    step = np.linalg.solve(np.linalg.inv(C) + there.information - summary.information, pull[1] - pull[0])
    return float(np.max(np.abs(step) / np.sqrt(np.diag(C))))


def responses_agree(result: CalibrationResult) -> Agreement | None:
    """Whether frequency responses tell what the other kinds tell; None without any, or where values were held."""
    summary = next((problem for problem, *_ in result.sets if isinstance(problem, FrequencySummary)), None)
    if summary is None or not set(summary.names) <= set(result.names):
        return None
    parameters = [result.robot.parameters[name] for name in summary.names]
    unit = np.array([p.coordinate_sigma for p in parameters])
    prior = np.array([np.log(p.prior) if p.positive else p.prior for p in parameters])
    at, C, widened = coordinates_told(result, summary.names)
    eye, x = np.eye(len(unit)), (at - prior) / unit
    told = np.linalg.inv(C / np.outer(unit, unit)) - eye
    A = summary.information * np.outer(unit, unit)
    preferred = (summary.preferred - prior) / unit
    others = told - A
    size, U = np.linalg.eigh(0.5 * (others + others.T))
    kept = size > 1e-9 * max(float(size.max()), 1.0)
    U, size = U[:, kept], size[kept]
    theirs = U @ ((U.T @ ((eye + told) @ x - A @ preferred)) / size)
    A_others = (U * size) @ U.T / np.outer(widened, widened)
    means = [np.linalg.solve(eye + each, each @ m) for each, m in ((A_others, theirs), (A, preferred))]
    return agreement((means[0], A_others), (means[1], A))


def coordinates_told(result: CalibrationResult, names: Sequence[str]) -> tuple[Array, Array, Array]:
    """Coordinates of some values, their covariance before sigmas were widened, and the factors of that."""
    free: Callable[[str], int] = result.names.index
    index, by_name = [free(name) for name in names], {p.name: p for p in result.parameters}
    found = [by_name[name] for name in names]
    positive = np.array([result.robot.parameters[name].positive for name in names])
    values = np.array([p.value for p in found])
    factor = np.array([result.sigma_inflation.get(name, 1.0) for name in names])
    sigmas = np.array([p.sigma for p in found]) / factor / np.where(positive, values, 1.0)
    at = np.where(positive, np.log(np.where(positive, values, 1.0)), values)
    return at, result.correlation[np.ix_(index, index)] * np.outer(sigmas, sigmas), factor


def _of_names(robot: Robot, found: Robot, names: Sequence[str]) -> Robot:
    """A robot with the values that another one found, of the parameters that are free here."""
    return robot.with_values({name: found.parameters[name].value for name in names})
