# SPDX-License-Identifier: BSD-3-Clause
"""Rests, poses and frequency responses in one graph, which each kind alone has brought near its end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.frequency.calibrate_frequency import FrequencyCalibration
from jointscope.graphs.frequency.frequency_summary import FrequencySummary
from jointscope.graphs.joint_kinds.beside_motion import moved, summary_at
from jointscope.graphs.joint_kinds.calibrate_kinds import KindsCalibration
from jointscope.graphs.poses.calibrate_poses import PoseCalibration, calibrate_poses
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.calibrate_rests import MOST_ITERATIONS
from jointscope.graphs.solving.batch_solver import Progress, Solution, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.graphs.solving.set_problem import SetProblem
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses

Array = NDArray[np.float64]
MOST_PASSES = 3  # of the place where responses are linearised
AGREES = 0.1  # [sigma] that no value may move any more

StillCalibration = KindsCalibration | PoseCalibration | FrequencyCalibration
"""Of poses, frequency responses or both."""


@dataclass(frozen=True)
class AllKinds:
    """All kinds, solved: friction is where it is likeliest.

    Attributes:
        poses: the poses with the others in their graph; None without.
        summary: the responses as a factor; None without.
        rests: of each recording.
        problems: all of them in this order.
        solution: of these.
    """

    poses: PoseCalibration | None
    summary: FrequencySummary | None
    rests: tuple[RestSet, ...]
    problems: tuple[SetProblem, ...]
    solution: Solution

    @property
    def calibration(self) -> Calibration:
        """Values of the robot."""
        return self.solution.estimate.calibrations[-1].only([DYNAMICS])

    @property
    def states(self) -> tuple[Array, ...]:
        """Where links and motors stand at each rest."""
        return self.solution.estimate.states[-len(self.rests) :]

    @property
    def covariance(self) -> Array:
        """Of the coordinates of the robot's values, shape (p, p)."""
        index = self.solution.shared.indices(len(self.problems) - 1)[self.calibration.columns[DYNAMICS]]
        return np.asarray(posteriors(self.problems, self.solution)[1][np.ix_(index, index)])


def poses_of(others: StillCalibration) -> PoseCalibration | None:
    """The poses of a calibration; None without."""
    if isinstance(others, KindsCalibration):
        return others.poses
    return others if isinstance(others, PoseCalibration) else None


def frequency_of(others: StillCalibration) -> FrequencyCalibration | None:
    """The frequency responses of a calibration; None without."""
    if isinstance(others, KindsCalibration):
        return others.frequency
    return others if isinstance(others, FrequencyCalibration) else None


def told_by(others: StillCalibration) -> tuple[str, ...]:
    """Names of the parameters of which a calibration tells anything."""
    if isinstance(others, KindsCalibration):
        return tuple({*others.poses.told, *others.frequency.told})
    return others.told


def solve_all_kinds(
    near: Robot,
    weighed: Sequence[RestSet],
    others: StillCalibration,
    sessions: Sequence[Poses],
    report: Progress,
) -> AllKinds:
    """All kinds in one graph, the responses linearised where it has its solution.

    Args:
        near: the robot with values near the end.
        weighed: rests with the weights that they deserve.
        others: the other kinds without rests.
        sessions: as of `calibrate_poses`.
        report: called with a text and the share done.

    Raises:
        SolveError: no convergence.
    """
    rests = tuple(problem.of_robot(near) for problem in weighed)
    frequency, poses = frequency_of(others), None
    summary = None if frequency is None else frequency.summary.of_robot(near)
    for _ in range(MOST_PASSES):
        still: list[SetProblem] = [*rests] if summary is None else [summary, *rests]
        if sessions:
            poses = calibrate_poses(near, sessions, report, still)
        at_poses = poses.problems if poses else ()
        common = poses.calibrations[0] if poses else Calibration.of(near)
        begun = [problem.start(common) for problem in still]
        states = (*(np.zeros_like(problem.q) for problem in at_poses), *(x for x, _ in begun))
        known = (*(poses.calibrations if poses else ()), *(at for _, at in begun))
        problems = (*at_poses, *still)
        solution = solve(problems, Estimate(states, known), max_iterations=MOST_ITERATIONS)
        if not (solution.converged or solution.flat):
            raise SolveError(
                f"no convergence after {len(solution.iterations)} iterations over rests and the other kinds; each "
                "alone was calibrated, so they contradict each other: calibrate each alone and compare the values"
            )
        graph = AllKinds(poses, summary, rests, problems, solution)
        if summary is None:
            break
        found = graph.calibration.by_name
        there = summary_at(summary, near.with_values(found))
        if moved(graph.calibration.dynamics, graph.covariance, summary, there) < AGREES:
            break
        summary = there.of_robot(near)
    return graph
