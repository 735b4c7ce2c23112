# SPDX-License-Identifier: BSD-3-Clause
"""Which of the leading effects makes recordings of an arm likeliest, by calibrations with each of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
from jointscope.graphs.frequency.frequency_set import BAND
from jointscope.graphs.joint_kinds.arm_candidates import Calibrated
from jointscope.graphs.joint_kinds.calibrate_kinds import MOST_PASSES, calibrate_kinds
from jointscope.graphs.joint_kinds.effect_judge import ArmCandidate
from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.graphs.poses.trimmed_poses import squared_distances
from jointscope.robots.errors import RecordingError, SolveError
from jointscope.robots.geometry.added_effect import with_effect
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses
from jointscope.robots.recordings.signals import Excitation, Signals

Shaken = tuple[Signals, Excitation]
Report = Callable[[str, float], None]
STAGES = 8  # of a model that may lack something, which need not come to rest
RACE = 4  # stages after which leading effects are told apart: the first with the covariance of few lines
LEADING, NEARLY = 3, 0.3  # effects that are calibrated for real, and their evidence over that of the best one


def calibrated(
    robot: Robot,
    sessions: Sequence[Poses],
    recordings: Sequence[Shaken],
    near: bool = False,
    most: int = STAGES,
    passes: int = MOST_PASSES,
) -> Calibrated:
    """Calibrates with what there is, in one graph; a model that lacks a spring need not explain most of the torques.

    Args:
        robot: the model.
        sessions: poses.
        recordings: of the arm shaken.
        near: whether its values are near the end.
        most: number of stages.
        passes: of stages and poses in turn.
    """
    if not recordings:
        return Calibrated(calibrate_poses(robot, sessions), None)
    if not sessions:
        return Calibrated(None, calibrate_frequency(robot, recordings, near=near, most=most, complete=False))
    both = calibrate_kinds(robot, recordings, sessions, None, near, most, passes, complete=False)
    return Calibrated(both.poses, both.frequency)


def leading_effects(candidates: Sequence[ArmCandidate]) -> list[ArmCandidate]:
    """Missing effects that may turn out to be the best one."""
    found = sorted((c for c in candidates if c.verdict == "missing"), key=lambda c: -c.evidence)
    return [c for c in found if c.evidence > NEARLY * found[0].evidence][:LEADING]


def likeliest_effect(
    result: Calibrated,
    leading: Sequence[ArmCandidate],
    begins: Mapping[str, Robot],
    sessions: Sequence[Poses],
    recordings: Sequence[Shaken],
    report: Report,
) -> tuple[ArmCandidate, Calibrated] | None:
    """The effect that makes the recordings likeliest, and the model with it; None where none of them does."""
    if not recordings:
        return leading[0], calibrated(_with(result.robot, leading[0]), sessions, ())
    most, passes = (RACE, 1) if len(leading) > 1 else (STAGES, MOST_PASSES)
    found = []
    for candidate in leading:
        report(f"calibrating with {candidate.hypothesis.label}", 0.5)
        begin = begins.get(candidate.hypothesis.label) or _with(result.robot, candidate)
        try:
            other = calibrated(begin, sessions, recordings, True, most, passes)
        except (RecordingError, SolveError):
            continue  # what takes the place of another effect may have no end, or lead the arm past its targets
        looks = 2.0 * float(np.log(max(len(candidate.hypothesis.kind.orders), 1)))
        found.append((_unlikely(other, result) + looks, candidate, other))
    if not found:
        return None
    _, candidate, other = min(found, key=lambda each: each[0])
    if most < STAGES:
        other = calibrated(other.robot, sessions, recordings, near=True)
    return (candidate, other) if _unlikely(other, result) < _unlikely(result, result) else None


def _unlikely(result: Calibrated, base: Calibrated) -> float:
    """Minus twice the logarithm of the likelihood of all recordings, but for a constant.

    A band of neighbouring lines counts as one; of poses the size of the noise is open, its shape is that of `base`.
    """
    total = 0.0
    if result.frequency is not None:
        total += sum(problem.stage.unlikely for problem in result.frequency.problems) / BAND
    if result.poses is not None and base.poses is not None:
        pairs = zip(base.poses.problems, result.poses.problems, result.poses.calibrations, strict=True)
        squares = [
            squared_distances(replace(p, robot=replace(own.robot, poses=p.robot.poses)), c).sum() for p, own, c in pairs
        ]
        total += sum(problem.measured for problem in base.poses.problems) * float(np.log(sum(squares)))
    return total


def _with(robot: Robot, found: ArmCandidate) -> Robot:
    """The robot with an effect, beginning at the sizes that were seen."""
    hypothesis = found.hypothesis
    if hypothesis.kind.soft:
        largest = max(found.sizes)
        sizes = [1.0 / max(size, 0.1 * largest) for size in found.sizes]
    else:
        sizes = list(found.sizes)
    return with_effect(robot, hypothesis, dict(zip(hypothesis.names, sizes, strict=True)))
