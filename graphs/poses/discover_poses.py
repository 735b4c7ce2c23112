# SPDX-License-Identifier: BSD-3-Clause
"""What a model of an arm lacks, from poses: effects are added as long as poses that were left out are met better.

Every effect that is not there is fitted, linearly, to all poses but those of one fold in turn, and judged on that fold,
with one noise for all, that of the present model. The best one is added if it is significant among so many, helps most
folds, and has possible sizes; then the arm is calibrated again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc

from jointscope.factors.calibration import Calibration
from jointscope.graphs.poses.calibrate_poses import (
    TOUCHED,
    PoseCalibration,
    calibrate_poses,
    placed,
    squared_distances,
)
from jointscope.graphs.poses.linear_poses import LinearPoses, columns_of
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.ripple_orders import with_best_order
from jointscope.graphs.poses.tip_errors import TipErrors, summary, tip_errors
from jointscope.robots.geometry.arm_effects import ArmHypothesis, hypotheses
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses

Array = NDArray[np.float64]
FOLDS = 10
CHANCE = 0.01  # of any false effect among all that are looked at
MOST = 0.6  # share of the folds that must be met better
GAIN = 0.02  # of the squared distances of the left-out poses
ALIKE = 0.95  # correlation of columns after all else
MOST_STEPS = 8


@dataclass(frozen=True)
class PoseCandidate:
    """An effect that was looked at.

    Attributes:
        hypothesis: effect and owner.
        score: fall of chi2 on all poses.
        p_value: of that fall by chance, of the best one of as many orders as were looked at.
        gain: share of the squared distances of left-out poses that it takes away.
        helped: share of the folds that it helps.
        sizes, sigmas: of its parameters; of stiffnesses their compliances.
        look_alikes: labels of effects that would do the same here.
        verdict: missing, possible or absent.
    """

    hypothesis: ArmHypothesis
    score: float
    p_value: float
    gain: float
    helped: float
    sizes: tuple[float, ...]
    sigmas: tuple[float, ...]
    look_alikes: tuple[str, ...]
    verdict: str


@dataclass(frozen=True)
class PoseStep:
    """One model on the way: what was added, its calibration, its errors where they were not fitted."""

    added: PoseCandidate | None
    result: PoseCalibration
    heldout: TipErrors | None
    candidates: tuple[PoseCandidate, ...]


@dataclass(frozen=True)
class PoseDiscovery:
    """All steps, why it ended, and the poses that never chose."""

    steps: tuple[PoseStep, ...]
    stop_reason: str
    holdout: tuple[PoseSet, ...] = ()

    @property
    def robot(self) -> Robot:
        """The last model."""
        return self.steps[-1].result.robot

    def whitened(self, step: PoseStep, sessions: Sequence[PoseSet]) -> float:
        """Root mean square error of a model on poses, per coordinate [sigma of the last model's noise]; 1 is noise."""
        found = []
        for problem in sessions:
            robot = replace(step.result.robot, poses=self.robot.poses)
            other = replace(problem, robot=robot, repeatability=1.0)
            found.append(squared_distances(other, other.start(Calibration.of(robot))[1]))
        return float(np.sqrt(np.mean(np.concatenate(found)) / 3.0))


def discover_poses(
    robot: Robot,
    sessions: Sequence[Poses],
    holdout: Sequence[Poses] = (),
    progress: Callable[[str, float], None] | None = None,
) -> PoseDiscovery:
    """Grows a model effect by effect.

    Args:
        robot: with a section `poses`.
        sessions: for training.
        holdout: scored once per step; never chooses.
        progress: called with a text and the share done.

    Raises:
        As `calibrate_poses`.
    """
    report = progress or (lambda text, share: None)
    report("base model", 0.0)
    result = calibrate_poses(robot, sessions)
    steps: list[PoseStep] = []
    added: PoseCandidate | None = None
    while True:
        report(f"looking for effect {len(steps) + 1}", len(steps) / (MOST_STEPS + 1))
        candidates = pose_candidates(result)
        steps.append(PoseStep(added, result, _heldout(result.robot, holdout), tuple(candidates)))
        found = [c for c in candidates if c.verdict == "missing"]
        if not found or len(steps) > MOST_STEPS:
            why = f"{MOST_STEPS} effects were added, the largest number allowed"
            if not found:
                why = "no effect is significant and meets left-out poses better"
            return PoseDiscovery(tuple(steps), why, tuple(placed(result.robot, holdout)[1]))
        added = max(found, key=lambda c: c.gain)
        result = calibrate_poses(_with(result.robot, added), sessions)


def pose_candidates(result: PoseCalibration) -> list[PoseCandidate]:
    """All effects that a calibrated arm lacks, best first."""
    linear, chain = LinearPoses.of(result), result.problems[0].arm.chain
    tracked = any(problem.poses.target is not None for problem in result.problems)
    looked_at = [with_best_order(linear, result, h) for h in hypotheses(chain.joints, result.robot.parameters, tracked)]
    columns = [linear.whitened(columns_of(result, h)) for h in looked_at]
    judge = _Judge(linear, len(looked_at))
    found = [judge.candidate(h, extra) for h, extra in zip(looked_at, columns, strict=True)]
    left = [_space(linear.beside(extra)) for extra in columns]
    named = []
    for i, candidate in enumerate(found):
        alike = [
            (other.gain, other.hypothesis.label)
            for j, other in enumerate(found)
            if j != i and candidate.score > 0.0 and _overlap(left[i], left[j]) > ALIKE
        ]
        names = tuple(label for _, label in sorted(alike, reverse=True)[:3])
        named.append(replace(candidate, look_alikes=names))
    return sorted(named, key=lambda c: -c.gain)


class _Judge:
    """What effects are worth on poses that they were not fitted to.

    Args:
        linear: the poses.
        count: number of effects that are looked at.
    """

    def __init__(self, linear: LinearPoses, count: int):
        self._linear, self._count = linear, count
        self._folds = _folds(linear.groups)
        nothing = np.zeros((len(linear.r), 0))
        base, _ = linear.fitted(nothing, np.zeros(0))
        self._left = float(linear.left(nothing, base).sum())
        self._before = self._left_out(nothing, np.zeros(0))

    def candidate(self, hypothesis: ArmHypothesis, extra: Array) -> PoseCandidate:
        """An effect with whitened columns of shape (3 m, k)."""
        linear, kind = self._linear, hypothesis.kind
        sigmas = np.full(extra.shape[1], kind.size)
        step, covariance = linear.fitted(extra, sigmas)
        score = self._left - float(linear.left(extra, step).sum())
        p_value = min(max(len(kind.orders), 1) * float(gammaincc(0.5 * extra.shape[1], max(score, 0.0) / 2.0)), 1.0)
        after = self._left_out(extra, sigmas)
        gain = 1.0 - after.sum() / max(self._before.sum(), 1e-300)
        helped = float(np.mean(after < self._before))
        p = len(linear.pull)
        sizes, own = step[p:], np.sqrt(np.diag(covariance))[p:]
        possible = not kind.soft or (bool(np.all(sizes > -own)) and bool(np.any(sizes > own)))
        significant = p_value * self._count < CHANCE
        verdict = "missing" if significant and gain > GAIN and helped >= MOST and possible else "absent"
        if verdict == "absent" and p_value < 1e-3 and gain > 0.0 and possible:
            verdict = "possible"
        if np.all(own > TOUCHED * sigmas):
            verdict = "untestable"
        return PoseCandidate(
            hypothesis, score, p_value, float(gain), helped, tuple(sizes.tolist()), tuple(own.tolist()), (), verdict
        )

    def _left_out(self, extra: Array, sigmas: Array) -> Array:
        """Squared distances of each fold, fitted to all others."""
        found = []
        for fold in range(int(self._folds.max()) + 1):
            held = self._folds == fold
            step, _ = self._linear.fitted(extra, sigmas, ~held)
            found.append(self._linear.left_out(extra, step, held))
        return np.array(found)


def _folds(groups: NDArray[np.intp]) -> NDArray[np.intp]:
    """Fold of each pose: whole groups, every tenth one together, so that neighbours in time are apart."""
    count = int(groups.max()) + 1
    return np.asarray(groups % min(FOLDS, count))


def _space(columns: Array) -> Array:
    """Orthonormal basis of what is left of columns."""
    U, s, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(U[:, s > 1e-9 * max(float(s.max(initial=0.0)), 1e-300)])


def _overlap(one: Array, other: Array) -> float:
    """Largest correlation of two spaces."""
    if not one.size or not other.size:
        return 0.0
    return float(np.linalg.svd(one.T @ other, compute_uv=False).max())


def _with(robot: Robot, found: PoseCandidate) -> Robot:
    """The robot with an effect, beginning at the sizes that were seen."""
    hypothesis = found.hypothesis
    if hypothesis.kind.soft:
        largest = max(found.sizes)
        sizes = [1.0 / max(size, 0.1 * largest) for size in found.sizes]
    else:
        sizes = list(found.sizes)
    return with_effect(robot, hypothesis, dict(zip(hypothesis.names, sizes, strict=True)))


def _heldout(robot: Robot, holdout: Sequence[Poses]) -> TipErrors | None:
    if not holdout:
        return None
    _, problems = placed(robot, holdout)
    return summary([tip_errors(problem) for problem in problems])
