# SPDX-License-Identifier: BSD-3-Clause
"""Geometry, drives and bearings of an arm from poses and frequency responses in one graph.

First the stages of the responses with the poses in the same graph; then the passes of the poses over outliers and
repeatability with the responses as the Gaussian factor that holds what is in doubt. Both again where poses change, from
the values and the stage that were found.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.frequency.agreement import Agreement, agreement
from jointscope.graphs.frequency.calibrate_frequency import FrequencyCalibration
from jointscope.graphs.frequency.frequency_summary import FrequencySummary
from jointscope.graphs.frequency.settled_stages import MOST_STAGES, settled_stages
from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.graphs.frequency.stages import first_stage
from jointscope.graphs.poses.calibrate_poses import AGREES, PoseCalibration, calibrate_poses
from jointscope.graphs.poses.trimmed_poses import squared_distances
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses
from jointscope.robots.recordings.signals import Excitation, Signals

Array = NDArray[np.float64]
MOST_PASSES = 3  # of stages and poses in turn


@dataclass(frozen=True)
class KindsCalibration:
    """Result of a calibration from poses and frequency responses.

    Attributes:
        robot: with the values that were found and their sigmas.
        poses: what the poses are at these values.
        frequency: what the responses are at these values.
        alone: the poses without the responses.
        summary: the responses as one factor.
        agreement: whether both kinds tell the same.
        wall_seconds: of the whole.
    """

    robot: Robot
    poses: PoseCalibration
    frequency: FrequencyCalibration
    alone: PoseCalibration
    summary: FrequencySummary
    agreement: Agreement
    wall_seconds: float

    @property
    def pose_squares(self) -> tuple[float, float]:
        """Sum of the squared distances of the poses in sigmas of the poses alone: alone, and in one estimate."""
        pairs = zip(self.alone.problems, self.alone.calibrations, self.poses.calibrations, strict=True)
        each = [(squared_distances(p, a).sum(), squared_distances(p, c).sum()) for p, a, c in pairs]
        return float(sum(a for a, _ in each)), float(sum(c for _, c in each))

    @property
    def frequency_squares(self) -> float:
        """Squared distance of the values from those that the responses alone prefer, in their sigmas."""
        own = self.summary.linearize(np.zeros((0, 1)), self.poses.calibrations[0])
        return 2.0 * own.cost


@in_solver_context
def calibrate_kinds(
    robot: Robot,
    recordings: Sequence[tuple[Signals, Excitation]],
    sessions: Sequence[Poses],
    progress: Progress | None = None,
    near: bool = False,
    most: int = MOST_STAGES,
    passes: int = MOST_PASSES,
    complete: bool = True,
) -> KindsCalibration:
    """Calibrates an arm from both kinds.

    Args:
        robot: with sections `frequency` and `poses`.
        recordings: as of `calibrate_frequency`.
        sessions: as of `calibrate_poses`.
        progress: called with a text and the share done.
        near: whether the values of the robot are near the end.
        most: number of stages.
        passes: of stages and poses in turn, at the most.
        complete: whether the model must explain most of the torques; one that lacks a spring does not.

    Raises:
        JointscopeError: as of both.
    """
    began, report = time.perf_counter(), progress or (lambda text, share: None)
    poses = alone = calibrate_poses(robot, sessions, report)
    base = alone.problems[0].robot
    first = [first_stage(base, ShakenPose.of(*recording)) for recording in recordings]
    problems, iterations, stages = first, 0, 0
    for i in range(passes):
        before = poses
        at = settled_stages(problems, list(poses.problems), report, near or i > 0, most, complete)
        problems, solution = at.problems, at.solution
        iterations, stages = iterations + at.iterations, stages + at.stages
        summary = FrequencySummary.of(problems, solution.estimate.calibrations[0])
        poses = calibrate_poses(robot, sessions, report, [summary])
        moved = abs(np.log(poses.repeatability / before.repeatability))
        if moved < AGREES and poses.left_out == before.left_out:
            break
        problems = [problem.of_robot(poses.robot) for problem in problems]
    poses = replace(poses, robot=at.told(poses.robot))
    report("done", 1.0)
    seconds = time.perf_counter() - began
    found = tuple(problem.of_robot(poses.robot) for problem in problems)
    told = poses.names, poses.covariance, iterations, stages, solution.cost, seconds, summary, at.settled
    frequency = FrequencyCalibration(poses.robot, robot, found, *told)
    return KindsCalibration(poses.robot, poses, frequency, alone, summary, _agreement(alone, summary), seconds)


def _agreement(alone: PoseCalibration, summary: FrequencySummary) -> Agreement:
    """Poses against responses, both in coordinates of unit prior variance."""
    robot, names = alone.problems[0].robot, alone.names
    unit = np.array([robot.parameters[name].coordinate_sigma for name in names])
    prior = Calibration.of(robot).dynamics
    A_poses = np.linalg.inv(alone.covariance / np.outer(unit, unit)) - np.eye(len(names))
    A = summary.information * np.outer(unit, unit)
    responses = np.linalg.solve(np.eye(len(names)) + A, A @ ((summary.preferred - prior) / unit))
    return agreement(((alone.calibrations[0].dynamics - prior) / unit, A_poses), (responses, A))
