# SPDX-License-Identifier: BSD-3-Clause
"""Shaken poses, stage after stage, until no value moves: covariances, friction and the moving arm follow the values.

The begin is the likeliest one of some, for a resonance that is looked for at the wrong place may not be found.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.frequency.frequency_set import FrequencySet
from jointscope.graphs.frequency.rattling import dwellings
from jointscope.graphs.frequency.stages import next_stage
from jointscope.graphs.responses.neighbouring_lines import NEIGHBOURS
from jointscope.graphs.solving.batch_solver import Progress, Solution, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.graphs.solving.set_problem import SetProblem
from jointscope.robots.errors import SolveError
from jointscope.robots.geometry.error_parameters import STIFFNESS
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import with_sigmas

Array = NDArray[np.float64]
MOST_STAGES = 25  # with little noise each is a tenth nearer than the one before
TRIALS = 2  # stages after which begins are told apart
SAME = 1.0  # of minus twice the logarithm of the likelihood: begins that differ by less led to the same place
AGREES = 0.1  # [sigma] that no value may move in a stage any more
ALIKE, MOST_RATIO = 0.5, 0.95  # squared cosine of steps in one direction, and how slowly they may fall
UNEXPLAINED = 0.5  # of the torques, rms: an arm of other springs than the model's leaves less
MOST_ITERATIONS = 80


@dataclass(frozen=True)
class Settled:
    """Where stages led.

    Attributes:
        problems: the poses at the last stage.
        solution: of it.
        iterations: of all stages.
        stages: how many there were.
        settled: whether nothing moved any more.
        last: how far each value moved in the last stage, by name, in the unit of the value.
    """

    problems: list[FrequencySet]
    solution: Solution
    iterations: int
    stages: int
    settled: bool
    last: Mapping[str, float]

    def told(self, robot: Robot) -> Robot:
        """The robot with sigmas that hold what stages may add that were not made: steps fall as slowly as they may."""
        if self.settled:
            return robot
        sigmas = {name: robot.parameters[name].sigma for name in self.last if name in robot.parameters}
        still = 1.0 / (1.0 - MOST_RATIO)
        wider = {n: float(np.hypot(s, still * self.last[n])) for n, s in sigmas.items() if s is not None}
        return replace(robot, parameters=with_sigmas(robot.parameters, wider))


def settled_stages(
    problems: list[FrequencySet],
    others: Sequence[SetProblem],
    report: Progress,
    near: bool = False,
    most: int = MOST_STAGES,
    complete: bool = True,
) -> Settled:
    """Poses at the stage after which nothing moves, or at the last of many.

    Args:
        problems: at their first stage.
        others: recordings of other kinds in the same graph.
        report: as of `calibrate_frequency`.
        near: whether the robot's values are near the end, so that the logarithm need not find the way.
        most: number of stages.
        complete: whether the model must explain most of the torques; one that lacks a spring does not.

    Raises:
        SolveError: a balance that explains nothing.
    """
    begin = _given if near else _best_begin
    problems, common, iterations = begin(problems, others)
    at, step = common.dynamics, None  # where the poses were linearised, and the step of the stage before
    for stage in range(most):
        solution, common = _solved(problems, others, common)
        iterations += len(solution.iterations)
        report(f"stage {stage + 1}, cost {solution.cost:.6g}", (stage + 1) / most)
        if not (solution.converged or solution.flat) or stage + 1 == most:
            break
        known = solution.estimate.calibrations[0]
        index = known.columns[DYNAMICS]
        sigmas = np.sqrt(np.diag(posteriors([*problems, *others], solution)[1])[index])
        moved, narrow = (known.dynamics - at) / sigmas, problems[0].stage.width == NEIGHBOURS
        if narrow and np.max(np.abs(moved)) < AGREES:
            must_explain(problems, known, complete)
            return Settled(problems, solution, iterations, stage + 1, True, {})
        ahead = _ahead(moved, None if step is None else step / sigmas)
        at, step = known.dynamics + ahead * sigmas, known.dynamics - at if narrow and not np.any(ahead) else None
        known = known.with_points({DYNAMICS: at})
        common = known.carried_to(common)
        problems = [next_stage(problem, known) for problem in problems]
    known = solution.estimate.calibrations[0]
    must_explain(problems, known, complete)
    steps = np.abs(known.dynamics - at) * known.value_by_coordinate
    last = dict(zip(known.names, steps.tolist(), strict=True))
    return Settled(problems, solution, iterations, stage + 1, False, last)


def must_explain(problems: Sequence[FrequencySet], known: Calibration, complete: bool = True) -> None:
    """Complains where the balance settled, but explains nothing.

    Args:
        problems: the poses.
        known: values.
        complete: of a model that need not be complete only gaps are told, in which no linear law holds.

    Raises:
        SolveError: it leaves most of the torques.
    """
    for problem in problems:
        values = problem.values(known)
        left = problem.torque_balance(values, problem.stiffness(values))
        share = float(np.linalg.norm(left) / np.linalg.norm(problem.pose.torques))
        if share > UNEXPLAINED and (complete or _rattling(problem)):
            why = _rattling(problem) or (
                "their sign, units, joints or start values may be wrong: look at `jointscope frequency BAG --report "
                "frf.html`; `jointscope discover` looks for a spring that the model lacks"
            )
            raise SolveError(
                f"{problem.pose.path}: the torque balance leaves {100.0 * share:.0f} % of the torques; {why}"
            )


def _rattling(problem: FrequencySet) -> str:
    """Which drive rattles in a gap, which makes a balance explain nothing; "" for none."""
    values = problem.robot.values
    each = dwellings(problem.pose, problem.arm.joints, values, problem.sharpness(values))
    rattling = [one for one in each if one.rattles]
    if rattling:
        worst = max(rattling, key=lambda one: one.share / one.smooth)
        return f"{worst}; shake it where its load keeps it on one side, and take the gap from --poses"
    return ""


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


def _given(
    problems: Sequence[FrequencySet], others: Sequence[SetProblem]
) -> tuple[list[FrequencySet], Calibration, int]:
    """Poses at a stage of the torque balance at the values that the robot has."""
    common = Calibration.of(problems[0].robot)
    return [next_stage(problem, common.only([DYNAMICS])) for problem in problems], common, 0


def _best_begin(
    problems: Sequence[FrequencySet], others: Sequence[SetProblem]
) -> tuple[list[FrequencySet], Calibration, int]:
    """Poses at a stage of the torque balance, values, and iterations: the begin whose residuals are the likeliest.

    The logarithm finds stiffnesses from far, but takes friction for damping, and may lead away what was nearly right.
    Where two begins lead to the same place, the third is not asked.
    """
    given = Calibration.of(problems[0].robot)
    mixed, logarithm, iterations = logarithm_begin(problems, others)
    found = []
    for begin in (mixed, logarithm, given):
        now, at, more = tried(problems, others, begin)
        iterations += more
        found.append((sum(problem.stage.unlikely for problem in now), now, at))
        if len(found) == 2 and abs(found[1][0] - found[0][0]) < SAME:
            break
    _, best, common = min(found, key=lambda each: each[0])
    return best, common, iterations


def logarithm_begin(
    problems: Sequence[FrequencySet], others: Sequence[SetProblem]
) -> tuple[Calibration, Calibration, int]:
    """Values with the stiffnesses that the logarithm finds, all values that it finds, and iterations."""
    given = Calibration.of(problems[0].robot)
    solution, logarithm = _solved(problems, others, given)
    springs = np.array([STIFFNESS in name for name in given.names])
    mixed = given.with_points({DYNAMICS: np.where(springs, logarithm.dynamics, given.dynamics)})
    return mixed, logarithm, len(solution.iterations)


def tried(
    problems: Sequence[FrequencySet], others: Sequence[SetProblem], begin: Calibration
) -> tuple[list[FrequencySet], Calibration, int]:
    """Poses some stages of the torque balance after a begin, values, and iterations."""
    at, now, iterations = begin, [next_stage(problem, begin.only([DYNAMICS])) for problem in problems], 0
    for _ in range(TRIALS):
        solution, at = _solved(now, others, at)
        iterations += len(solution.iterations)
        now = [next_stage(problem, at.only([DYNAMICS])) for problem in now]
    return now, at, iterations


def _solved(
    problems: Sequence[FrequencySet], others: Sequence[SetProblem], common: Calibration
) -> tuple[Solution, Calibration]:
    """The solution from these values on, and what it says of all shared values."""
    everything = [*problems, *others]
    starts = [problem.start(common) for problem in everything]
    estimate = Estimate(tuple(x for x, _ in starts), tuple(c for _, c in starts))
    solution = solve(everything, estimate, max_iterations=MOST_ITERATIONS)
    return solution, solution.estimate.calibrations[0].carried_to(common)
