# SPDX-License-Identifier: BSD-3-Clause
"""A trial of an effect that does nothing in the motion: all other kinds anew, the motion as the factor that it was.

All kinds are solved in one graph as `calibrate_shared` does, with the Gaussian factor of the motion in place of its
samples. Values that go too far for that factor are no trial of this kind.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointscope.factors.calibration import Calibration
from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings
from jointscope.graphs.across_kinds.shared_model import SharedModel, own_size, standing_still
from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
from jointscope.graphs.frequency.frequency_summary import FrequencySummary
from jointscope.graphs.joint_kinds.beside_motion import AGREES, MOST_PASSES, moved, summary_at
from jointscope.graphs.joint_kinds.motion_summary import MotionSummary
from jointscope.graphs.rests.calibrate_rests import MOST_ITERATIONS
from jointscope.graphs.solving.batch_solver import Progress, Solution, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.graphs.solving.set_problem import SetProblem
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import Robot

FAR = 3.0  # [sigma of all kinds] that values may move before the motion is linearised elsewhere


def does_nothing_in_motion(grown: Robot, robot: Robot) -> bool:
    """Whether a robot with more parameters is the same one for recordings of motion."""
    return grown.effects == robot.effects and grown.layout == robot.layout and grown.choices == robot.choices


def calibrate_trial(
    robot: Robot, given: KindsRecordings, base: SharedModel, motion: MotionSummary, report: Progress
) -> SharedModel | None:
    """Calibrates a model whose motion is that of a calibrated one; None where values move too far for that.

    Args:
        robot: with an effect that does nothing in the motion.
        given: recordings of all kinds.
        base: the model without the effect.
        motion: its motions as a factor.
        report: called with a text and the share done.

    Raises:
        JointscopeError: as of `calibrate_shared`.
    """
    robot, poses, at_rest = standing_still(robot, given, report)
    still: list[SetProblem] = [*at_rest, *own_size(robot, poses), motion.of_robot(robot)]
    common = Calibration.of(robot)
    summary = None
    if given.shaken:
        summary = calibrate_frequency(robot, given.shaken, report, near=True, complete=False).summary
    if summary is None:
        solution = _solved(still, common)
    else:
        summary = summary.without_friction()
        for _ in range(MOST_PASSES):
            problems = [*still, summary.of_robot(robot)]
            solution = _solved(problems, common)
            common = solution.estimate.calibrations[0].carried_to(common)
            there = summary_at(summary, robot.with_values(common.by_name)).without_friction()
            if _goes_on(problems, solution, summary, there) < AGREES:
                break
            summary = there
    found = solution.estimate.calibrations[0].carried_to(common)
    if motion.moved(found) > FAR:
        return None
    assert base.motion is not None
    own = [Calibration.of(robot).with_points(c.own).with_points(found.common) for c in base.motion.calibrations]
    tried = robot.with_values(found.by_name)
    return SharedModel(
        tried, replace(base.motion, robot=tried, calibrations=tuple(own)), None, poses, tuple(at_rest), False
    )


def _solved(problems: list[SetProblem], common: Calibration) -> Solution:
    """All kinds from some values on.

    Raises:
        SolveError: no convergence.
    """
    starts = [problem.start(common) for problem in problems]
    begin = Estimate(tuple(x for x, _ in starts), tuple(at for _, at in starts))
    solution = solve(problems, begin, max_iterations=MOST_ITERATIONS)
    if not (solution.converged or solution.flat):
        raise SolveError(f"no convergence after {len(solution.iterations)} iterations over all kinds")
    return solution


def _goes_on(
    problems: list[SetProblem], solution: Solution, summary: FrequencySummary, there: FrequencySummary
) -> float:
    """How far values would go with the responses linearised where they are now [sigma]."""
    at = solution.estimate.calibrations[-1]
    places = [at.names.index(name) for name in summary.names]
    covariance = posteriors(problems, solution)[1][np.ix_(places, places)]
    return moved(at.dynamics[places], np.asarray(covariance), summary, there)
