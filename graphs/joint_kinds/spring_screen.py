# SPDX-License-Identifier: BSD-3-Clause
"""Springs that a model lacks where it is so wrong that no linear step from it tells which.

A joint or bearing that gives way with its resonance among the lines drives all other springs to values that have no
meaning, and from there its own slope is not the way back; nor is that of a drive that hardens so much that it has
another stiffness in every pose. So each spring that a joint may have beside its drive, and the hardening of each drive,
is put in at the values with which the calibration began, and a few stages are solved: how much likelier the recordings
become tells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import gammaincc

from jointscope.factors.calibration import Calibration
from jointscope.graphs.frequency.calibrate_frequency import FrequencyCalibration
from jointscope.graphs.frequency.explained import Explained
from jointscope.graphs.frequency.frequency_set import BAND, FrequencySet
from jointscope.graphs.frequency.settled_stages import logarithm_begin, tried
from jointscope.graphs.frequency.stages import first_stage
from jointscope.graphs.joint_kinds.effect_judge import ArmCandidate, Gain
from jointscope.robots.geometry.added_effect import with_effect
from jointscope.robots.geometry.arm_effects import FREQUENCY, ArmHypothesis
from jointscope.robots.geometry.error_parameters import CUBIC, STIFFNESS
from jointscope.robots.model.robot import Robot

BEGIN = 5e4  # [N m/rad] of a spring that is put in
HARDENS = 1e-3  # [rad] of deflection at which a drive that hardens begins with twice its stiffness
ANSWERED, SURE = 0.5, 5.0  # share of what is left in a band that answers the excitation, and its sigmas
LEAST = 30.0  # of twice the logarithm of the likelihood, a band of lines counted as one


def badly_explained(found: Explained) -> bool:
    """Whether most of what is left in some band answers the excitation, so that a response is missing."""
    bands = [band for pose in found.poses for band in pose.answered]
    return any(band.share > max(ANSWERED, SURE * band.sigma) for band in bands)


def screened_springs(
    result: FrequencyCalibration, candidates: Sequence[ArmCandidate]
) -> list[tuple[ArmCandidate, Robot]]:
    """Springs of locked joints and of bearings, and drives that harden, that make the recordings likelier, best first.

    Each has a robot that begins with it.

    Args:
        result: of the model without them.
        candidates: what is known of all effects.
    """
    robot, poses = result.start, [problem.pose for problem in result.problems]
    shaken = () if robot.frequency is None else robot.frequency.joints
    tried_ones = [c for c in candidates if _is_tried(c.hypothesis, shaken)]
    if not tried_ones:
        return []
    mixed, _, _ = logarithm_begin([first_stage(robot, pose) for pose in poses], [])
    robot = robot.with_values(mixed.by_name)
    before, _ = _few_stages(robot, [first_stage(robot, pose) for pose in poses])
    found = []
    for candidate in tried_ones:
        hypothesis = candidate.hypothesis
        other = with_effect(robot, hypothesis, dict.fromkeys(hypothesis.names, _begin(robot, hypothesis)))
        after, values = _few_stages(other, [first_stage(other, pose) for pose in poses])
        falls = [(b - a) / BAND for b, a in zip(before, after, strict=True)]
        if sum(falls) > LEAST:
            found.append((_with_fall(candidate, falls, values, result), values))
    return sorted(found, key=lambda each: -each[0].evidence)


def _is_tried(hypothesis: ArmHypothesis, shaken: Sequence[str]) -> bool:
    if hypothesis.names == (f"{hypothesis.owner}.{CUBIC}",):
        return hypothesis.owner in shaken
    return hypothesis.kind.soft


def _begin(robot: Robot, hypothesis: ArmHypothesis) -> float:
    if hypothesis.kind.soft:
        return BEGIN
    return robot.parameters[f"{hypothesis.owner}.{STIFFNESS}"].value / (3.0 * HARDENS**2)


def _few_stages(robot: Robot, problems: Sequence[FrequencySet]) -> tuple[list[float], Robot]:
    """How unlikely each recording is after them, and the robot with their values."""
    now, at, _ = tried(problems, [], Calibration.of(robot))
    values = at.by_name
    return [problem.stage.unlikely for problem in now], robot.with_values(values)


def _with_fall(
    candidate: ArmCandidate, falls: Sequence[float], robot: Robot, result: FrequencyCalibration
) -> ArmCandidate:
    """The candidate with what its stages told; its sigmas are not known before it is calibrated."""
    hypothesis: ArmHypothesis = candidate.hypothesis
    fall, count = sum(falls), sum(problem.measured for problem in result.problems) / BAND
    values = [robot.parameters[name].value for name in hypothesis.names]
    sizes = tuple(1.0 / value if hypothesis.kind.soft else value for value in values)
    gain = Gain(1.0 - float(np.exp(-fall / count)), sum(f > 0.0 for f in falls) / len(falls))
    return replace(
        candidate,
        score=fall,
        p_value=float(gammaincc(float(len(sizes)), fall / 2.0)),
        evidence=fall,
        gains={**candidate.gains, FREQUENCY: gain},
        sizes=sizes,
        sigmas=tuple(abs(size) for size in sizes),
        verdict="missing",
    )
