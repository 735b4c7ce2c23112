# SPDX-License-Identifier: BSD-3-Clause
"""Stiffnesses and dampings of drives and bearings from frequency responses, with sigmas that hold what is in doubt.

First the logarithm of the response matrices, which finds the way from far; then the torque balance, stage after stage,
until the values stay. Then the responses become the Gaussian factor that holds what is in doubt, alone or with poses.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.frequency.explained import Explained, explained
from jointscope.graphs.frequency.frequency_set import FrequencySet
from jointscope.graphs.frequency.frequency_summary import FrequencySummary
from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.graphs.frequency.stages import first_stage, next_stage
from jointscope.graphs.responses.response_matrix import NEIGHBOURS
from jointscope.graphs.solving.batch_solver import Progress, Solution, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.graphs.solving.set_problem import SetProblem
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.robots.errors import SolveError
from jointscope.robots.geometry.error_parameters import STIFFNESS
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import with_sigmas
from jointscope.robots.recordings.signals import Excitation, Signals

Array = NDArray[np.float64]
MOST_STAGES = 25  # with little noise each is a tenth nearer than the one before
TRIALS = 2  # stages after which begins are told apart
SAME = 1.0  # of minus twice the logarithm of the likelihood: begins that differ by less led to the same place
AGREES = 0.1  # [sigma] that no value may move in a stage any more
ALIKE, MOST_RATIO = 0.5, 0.95  # squared cosine of steps in one direction, and how slowly they may fall
UNEXPLAINED = 0.5  # of the torques, rms: an arm of other springs than the model's leaves less
MOST_ITERATIONS = 80
TOLD = 0.4  # of its prior's sigma: a value whose sigma stays above it is not identifiable
WELL = 0.1  # of itself, by how much a positive value that is told may be wrong; a tenth is usual for dynamic parameters


@dataclass(frozen=True)
class FrequencyCalibration:
    """Result of a calibration from frequency responses.

    Attributes:
        robot: with the values that were found and their sigmas.
        start: before.
        problems: the poses.
        names: of the free parameters, shape (p,).
        covariance: of their coordinates (logarithms of positive ones), shape (p, p).
        iterations: of all stages.
        stages: how many there were.
        cost: at the end.
        wall_seconds: of the whole.
    """

    robot: Robot
    start: Robot
    problems: tuple[FrequencySet, ...]
    names: tuple[str, ...]
    covariance: Array
    iterations: int
    stages: int
    cost: float
    wall_seconds: float

    @property
    def told(self) -> tuple[str, ...]:
        """Names of the parameters that the responses tell: well within their priors, positive ones to a tenth, too."""
        sigmas = dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))
        parameters = [self.robot.parameters[name] for name in self.names]
        most = {p.name: TOLD * p.coordinate_sigma for p in parameters}
        most |= {p.name: min(most[p.name], WELL) for p in parameters if p.positive}
        return tuple(name for name in self.names if sigmas[name] < most[name])

    @property
    def silent(self) -> tuple[str, ...]:
        """Springs, dampers and friction of the motors that they do not tell."""
        asked = {spring.stiffness for spring in self.problems[0].arm.springs}
        asked |= {spring.damping for spring in self.problems[0].arm.springs}
        return tuple(name for name in self.names if name in asked and name not in self.told)

    @cached_property
    def explained(self) -> Explained:
        """Whether the poses are explained."""
        return explained(self.robot, self.problems)

    def rms_log(self, robot: Robot) -> dict[str, Any]:
        """How far the model's matrix is from the measured one: rms of the logarithm, and of each entry."""
        parts = [p.of_robot(robot).log_errors() for p in self.problems]
        square = np.mean([np.mean(np.abs(part) ** 2, axis=0) for part in parts], axis=0)
        entries = {f"{i + 1},{j + 1}": float(np.sqrt(square[i, j])) for i, j in np.ndindex(square.shape)}
        return {"rms_log": float(np.sqrt(square.mean())), "entries": entries}

    def to_json(self) -> dict[str, Any]:
        """The content of `--json`."""
        parameters = self.robot.parameters
        table = {
            n: {"value": p.value, "sigma": p.sigma, "unit": p.unit} for n, p in parameters.items() if n in self.names
        }
        return {
            "converged": True,
            "iterations": self.iterations,
            "samples": sum(problem.measured for problem in self.problems),
            "wall_seconds": self.wall_seconds,
            "cost": self.cost,
            "parameters": table,
            "told": list(self.told),
            "undetermined": [{name: 1.0} for name in self.silent],
            "explained": self.explained.to_json(),
            "frequency": self.rms_log(self.robot),
            "frequency_before": self.rms_log(self.start),
        }


@in_solver_context
def calibrate_frequency(
    robot: Robot, recordings: Sequence[tuple[Signals, Excitation]], progress: Progress | None = None
) -> FrequencyCalibration:
    """Calibrates an arm from frequency responses.

    Args:
        robot: with a section `frequency`, start values and priors.
        recordings: torques of the motors that are shaken, positions of all joints, and the excitation, of each pose.
        progress: called with a text and the share done.

    Raises:
        RecordingError: a recording shows no response.
        SolveError: no convergence.
    """
    began, report = time.perf_counter(), progress or (lambda text, share: None)
    problems = [first_stage(robot, ShakenPose.of(*recording)) for recording in recordings]
    problems, solution, iterations, stages = settled_stages(problems, [], report)
    summary = FrequencySummary.of(problems, solution.estimate.calibrations[0])
    start = Estimate(solution.estimate.states[:1], solution.estimate.calibrations[:1])
    settled = solve([summary], start, max_iterations=MOST_ITERATIONS)
    calibration = settled.estimate.calibrations[0]
    index = calibration.columns[DYNAMICS]
    covariance = np.asarray(posteriors([summary], settled)[1])[index, index]
    sigmas = np.sqrt(np.diag(covariance)) * calibration.value_by_coordinate
    found = robot.with_values(dict(zip(calibration.names, calibration.values.tolist(), strict=True)))
    told = dict(zip(calibration.names, sigmas.tolist(), strict=True))
    found = replace(found, parameters=with_sigmas(found.parameters, told))
    report("done", 1.0)
    return FrequencyCalibration(
        robot=found,
        start=robot,
        problems=tuple(problem.of_robot(found) for problem in problems),
        names=calibration.names,
        covariance=covariance,
        iterations=iterations,
        stages=stages,
        cost=solution.cost,
        wall_seconds=time.perf_counter() - began,
    )


def settled_stages(
    problems: list[FrequencySet], others: Sequence[SetProblem], report: Progress
) -> tuple[list[FrequencySet], Solution, int, int]:
    """Poses at the stage after which nothing moves, their solution, iterations and stages.

    Args:
        problems: at their first stage.
        others: recordings of other kinds in the same graph.
        report: as of `calibrate_frequency`.

    Raises:
        SolveError: no convergence.
    """
    problems, common, iterations = _best_begin(problems, others)
    at, step = common.dynamics, None  # where the poses were linearised, and the step of the stage before
    for stage in range(MOST_STAGES):
        solution, common = _solved(problems, others, common)
        iterations += len(solution.iterations)
        report(f"stage {stage + 1}, cost {solution.cost:.6g}", (stage + 1) / MOST_STAGES)
        if not (solution.converged or solution.flat):
            break
        known = solution.estimate.calibrations[0]
        index = known.columns[DYNAMICS]
        sigmas = np.sqrt(np.diag(posteriors([*problems, *others], solution)[1])[index])
        moved, narrow = (known.dynamics - at) / sigmas, problems[0].stage.width == NEIGHBOURS
        if narrow and np.max(np.abs(moved)) < AGREES:
            _check_left(problems, known)
            return problems, solution, iterations, stage + 1
        ahead = _ahead(moved, None if step is None else step / sigmas)
        at, step = known.dynamics + ahead * sigmas, known.dynamics - at if narrow and not np.any(ahead) else None
        known = known.with_points({DYNAMICS: at})
        common = known.carried_to(common)
        problems = [next_stage(problem, known) for problem in problems]
    raise SolveError(
        f"no convergence after {iterations} iterations and {stage + 1} stages over {len(problems)} poses; torques, "
        "units, joints or start values may be wrong: look at `jointscope frequency BAG --report frf.html`"
    )


def _check_left(problems: Sequence[FrequencySet], known: Calibration) -> None:
    """Complains where the balance settled, but explains nothing.

    Raises:
        SolveError: it leaves most of the torques.
    """
    for problem in problems:
        values = problem.values(known)
        left = problem.torque_balance(values, problem.stiffness(values))
        share = float(np.linalg.norm(left) / np.linalg.norm(problem.pose.torques))
        if share > UNEXPLAINED:
            raise SolveError(
                f"{problem.pose.path}: the torque balance leaves {100.0 * share:.0f} % of the torques; their sign, "
                "units, joints or start values may be wrong: look at `jointscope frequency BAG --report frf.html`"
            )


def _ahead(step: Array, before: Array | None) -> Array:
    """What all stages to come will add if their steps go on as two did: covariances follow values slowly.

    Args:
        step: of this stage, shape (p,) [sigma].
        before: of the stage before, if both were plain.
    """
    if before is None:
        return np.zeros_like(step)
    ratio = float(step @ before) / max(float(before @ before), 1e-300)
    alike = float(step @ before) ** 2 > ALIKE * float(step @ step) * float(before @ before)
    ratio = min(ratio, MOST_RATIO)  # below zero steps go to and fro, and the end is in between
    return step * (ratio / (1.0 - ratio) if alike else 0.0)


def _best_begin(
    problems: Sequence[FrequencySet], others: Sequence[SetProblem]
) -> tuple[list[FrequencySet], Calibration, int]:
    """Poses at a stage of the torque balance, values, and iterations: the begin whose residuals are the likeliest.

    The logarithm finds stiffnesses from far, but takes friction for damping, and may lead away what was nearly right.
    Where two begins lead to the same place, the third is not asked.
    """
    given = Calibration.of(problems[0].robot)
    solution, logarithm = _solved(problems, others, given)
    iterations = len(solution.iterations)
    springs = np.array([STIFFNESS in name for name in given.names])
    mixed = given.with_points({DYNAMICS: np.where(springs, logarithm.dynamics, given.dynamics)})
    found = []
    for begin in (mixed, logarithm, given):
        at, now = begin, [next_stage(problem, begin.only([DYNAMICS])) for problem in problems]
        for _ in range(TRIALS):
            solution, at = _solved(now, others, at)
            iterations += len(solution.iterations)
            now = [next_stage(problem, at.only([DYNAMICS])) for problem in now]
        found.append((sum(problem.stage.unlikely for problem in now), now, at))
        if len(found) == 2 and abs(found[1][0] - found[0][0]) < SAME:
            break
    _, best, common = min(found, key=lambda each: each[0])
    return best, common, iterations


def _solved(
    problems: Sequence[FrequencySet], others: Sequence[SetProblem], common: Calibration
) -> tuple[Solution, Calibration]:
    """The solution from these values on, and what it says of all shared values."""
    everything = [*problems, *others]
    starts = [problem.start(common) for problem in everything]
    estimate = Estimate(tuple(x for x, _ in starts), tuple(c for _, c in starts))
    solution = solve(everything, estimate, max_iterations=MOST_ITERATIONS)
    return solution, solution.estimate.calibrations[0].carried_to(common)
