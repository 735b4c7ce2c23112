# SPDX-License-Identifier: BSD-3-Clause
"""One model for recordings of all kinds, calibrated in one graph, and how far off it is in each of them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings
from jointscope.graphs.across_kinds.said_by_kinds import MOTION, RESTS
from jointscope.graphs.calibration.base_model import BaseModel
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.frequency.compare_frequency import frequency_errors
from jointscope.graphs.joint_kinds.beside_motion import calibrate_beside_motion
from jointscope.graphs.joint_kinds.calibrate_with_rests import WithRests, calibrate_with_rests
from jointscope.graphs.poses.calibrate_poses import PoseCalibration, calibrate_poses
from jointscope.graphs.poses.tip_errors import whitened
from jointscope.graphs.poses.tracker_start import placed
from jointscope.graphs.refits.validation import fit_and_judge, judged_error, reported_heldout_error
from jointscope.graphs.rest_sets.rest_errors import rest_errors
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.rests_beside_motion import weighted_rests, with_rests
from jointscope.graphs.solving.batch_solver import Progress, Solver, solve
from jointscope.graphs.solving.set_problem import SetProblem
from jointscope.robots.geometry.arm_effects import FREQUENCY, POSES
from jointscope.robots.model.robot import Robot
from jointscope.robots.rests.rests import Rests


@dataclass(frozen=True)
class SharedModel:
    """A model calibrated with all recordings.

    Attributes:
        robot: with the values that all kinds have.
        motion: what it is for the recordings of motion; None without.
        still: the calibration of the kinds at rest; None beside motion.
        poses: the poses that were used, without outliers.
        weights: of rests, as their scatter asks for; empty without.
        settled: whether the samples of the motion were asked; of a trial their factor may have been.
    """

    robot: Robot
    motion: BaseModel | None
    still: WithRests | None
    poses: PoseCalibration | None
    weights: tuple[RestSet, ...]
    settled: bool = True


def calibrate_shared(
    robot: Robot,
    given: KindsRecordings,
    near: BaseModel | None,
    report: Progress,
    solver: Solver = solve,
) -> SharedModel:
    """Calibrates a model with all recordings in one graph.

    Args:
        robot: with values near the end.
        given: recordings of more than one kind.
        near: a model of the same motion, for states and biases of its recordings; None without motion.
        report: called with a text and the share done.
        solver: minimises the cost of all samples.

    Raises:
        JointscopeError: as of `calibrate`, `calibrate_poses`, `calibrate_frequency` and `calibrate_rests`.
    """
    if not given.motion:
        still = calibrate_with_rests(robot, given.rests, given.poses, given.shaken, report)
        return SharedModel(still.robot, None, still, still.poses, still.rests.problems)
    robot, poses, at_rest = standing_still(robot, given, report)
    still_sets: list[SetProblem] = [*at_rest, *own_size(robot, poses)]
    calibration = partial(calibrate, sets=still_sets)
    if given.shaken:
        calibration = partial(calibrate_beside_motion, shaken=given.shaken, sets=still_sets)
    motion = BaseModel.of(robot, given.motion, near, follow=True, solver=solver, calibration=calibration)
    result = with_rests(motion.result)
    motion = replace(motion, robot=result.robot, result=result)
    return SharedModel(result.robot, motion, None, poses, tuple(at_rest))


def standing_still(
    robot: Robot, given: KindsRecordings, report: Progress
) -> tuple[Robot, PoseCalibration | None, list[RestSet]]:
    """The kinds without states that move, each brought near its end alone; and the robot with what they know better.

    Arguments as of `calibrate_shared`.
    """
    poses = None
    if given.poses:
        poses = calibrate_poses(robot, given.poses, report)
        robot = _placed(robot, poses)
    robot, at_rest = weighted_rests(robot, given.motion, given.rests, report)
    return robot, poses, at_rest


def own_size(robot: Robot, poses: PoseCalibration | None) -> list[SetProblem]:
    """Poses whose robot has the sizes of noise that they told."""
    if poses is None:
        return []
    return [replace(problem, robot=robot, repeatability=1.0, turning=1.0) for problem in poses.problems]


def _placed(robot: Robot, poses: PoseCalibration) -> Robot:
    """The robot with the tracker and the noise that poses tell, and with the values that they know better."""
    parameters = robot.parameters
    better = {}
    for name in poses.told:
        own, known = poses.robot.parameters[name], parameters[name].sigma
        if known is None or own.sigma is None or own.sigma < known:
            better[name] = own.value
    return replace(robot.with_values(better), poses=poses.robot.poses)


def errors_by_kind(
    model: SharedModel, given: KindsRecordings, weights: SharedModel, kinds: Collection[str] | None = None
) -> dict[str, float]:
    """How far off a model is in its training recordings of some kinds, in sigmas of the noise of `weights`.

    Args:
        model: the model.
        given: all recordings for training.
        weights: whose noise counts.
        kinds: which of them; None for all.
    """
    asked, found = given.kinds if kinds is None else kinds, {}
    if model.motion is not None and MOTION in asked:
        base = model.motion
        found[MOTION] = judged_error(base, base.robot, base.calibrations, fit_and_judge(base)[1]).error
    if model.poses is not None and POSES in asked:
        found[POSES] = whitened(model.robot, weights.robot.poses, model.poses.problems)
    return found | _without_states(model.robot, given, weights, asked)


def heldout_by_kind(model: SharedModel, held: KindsRecordings, weights: SharedModel) -> dict[str, float]:
    """The same for recordings that it has not seen."""
    found = {}
    if held.motion:
        found[MOTION] = reported_heldout_error(model.robot, held.motion[0])
    if held.poses:
        found[POSES] = whitened(model.robot, weights.robot.poses, placed(model.robot, held.poses)[1])
    return found | _without_states(model.robot, held, weights, held.kinds)


def _without_states(
    robot: Robot, recordings: KindsRecordings, weights: SharedModel, asked: Collection[str]
) -> dict[str, float]:
    """Errors where the values say all: the share of the torques that is left, and what friction cannot hold."""
    found = {}
    if recordings.shaken and FREQUENCY in asked:
        left = [each.fit.left for each in frequency_errors(robot, recordings.shaken)]
        found[FREQUENCY] = float(np.sqrt(np.mean(np.square(np.concatenate(left)))))
    if recordings.rests and RESTS in asked:
        found[RESTS] = _at_rest(robot, recordings.rests, weights.weights)
    return found


def _at_rest(robot: Robot, recordings: Sequence[Rests], weights: Sequence[RestSet]) -> float:
    """Of the links [sigma]; of motors alone what friction cannot hold, as a part of its band."""
    weight = weights[0].repeatability
    found = rest_errors([replace(RestSet.of(robot, rests), repeatability=weight) for rests in recordings])
    if recordings[0].q_link is not None:
        return found.error
    return float(np.sqrt(np.mean(found.friction**2) / max(float(np.mean(found.half**2)), 1e-300)))
