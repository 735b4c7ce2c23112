# SPDX-License-Identifier: BSD-3-Clause
"""All effects that a calibrated arm lacks, judged by poses, by frequency responses, or by both together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.frequency.calibrate_frequency import FrequencyCalibration
from jointscope.graphs.frequency.linear_responses import STIFFNESSES, ResponseColumns
from jointscope.graphs.joint_kinds.effect_judge import ArmCandidate, EffectJudge, Looked, with_look_alikes
from jointscope.graphs.joint_kinds.linear_kinds import LinearKind, LinearKinds
from jointscope.graphs.joint_kinds.ripple_orders import with_best_order
from jointscope.graphs.poses.calibrate_poses import PoseCalibration
from jointscope.graphs.poses.linear_poses import LinearPoses, columns_of, prior_information, prior_pull
from jointscope.robots.errors import RobotError
from jointscope.robots.geometry.arm_effects import FREQUENCY, POSES, ArmHypothesis, hypotheses
from jointscope.robots.geometry.error_parameters import WAVES
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
ALIKE = 0.95  # correlation of columns after all else


@dataclass(frozen=True)
class Calibrated:
    """An arm calibrated from one kind or both in one graph.

    Attributes:
        poses: what poses are at the values; None without.
        frequency: what frequency responses are at them; None without.
    """

    poses: PoseCalibration | None
    frequency: FrequencyCalibration | None

    @property
    def robot(self) -> Robot:
        """With the values that were found."""
        found = self.poses or self.frequency
        assert found is not None
        return found.robot

    @property
    def effects(self) -> list[ArmHypothesis]:
        """What the model lacks, as far as one of the kinds shows it."""
        tracked, shaken, joints = False, None, self.robot.joints
        if self.poses is not None:
            tracked = any(problem.poses.target is not None for problem in self.poses.problems)
            joints = self.poses.problems[0].arm.chain.joints
        if self.frequency is not None and self.robot.frequency is not None:
            shaken = self.robot.frequency.joints
        found = hypotheses(joints, self.robot.parameters, tracked, shaken)
        return found if self.poses is not None else [h for h in found if not _needs_poses(h, shaken or ())]


def arm_candidates(result: Calibrated) -> list[ArmCandidate]:
    """All effects that a calibrated arm lacks, best first.

    Raises:
        RobotError: nothing was calibrated.
    """
    if result.poses is None and result.frequency is None:
        raise RobotError(f"{result.robot.name}: no recordings")
    poses = None if result.poses is None else LinearPoses.of(result.poses)
    responses, columns = None, None
    effects, robot = result.effects, result.robot
    if poses is not None and result.poses is not None:
        effects = [with_best_order(poses, result.poses, h) for h in effects]
    if result.frequency is not None:
        columns = ResponseColumns(robot, result.frequency.problems, effects)
        responses = columns.linear(0 if poses is None else poses.J.shape[1] - len(result.frequency.names))
    parts: list[LinearKind] = [part for part in (poses, responses) if part is not None]
    linear = LinearKinds(parts, *_ties(result, poses))
    judge = EffectJudge(linear, len(effects))
    looked, found = list[Looked](), []
    for hypothesis in effects:
        extra: dict[str, Array] = {}
        if poses is not None and result.poses is not None and POSES not in hypothesis.kind.unseen:
            extra[POSES] = poses.whitened(columns_of(result.poses, hypothesis))
        looks = max(len(hypothesis.kind.orders), 1)
        if columns is not None and FREQUENCY not in hypothesis.kind.unseen:
            extra, looks = _with_responses(judge, columns, hypothesis, extra, looks)
        looked.append((hypothesis, extra, looks))
        found.append(judge.candidate(hypothesis, extra, looks))
    extras = [extra for _, extra, _ in looked]
    alone = {part.kind: _alike(_spaces([part], linear, extras)) for part in parts} if len(parts) > 1 else {}
    found = with_look_alikes(found, alone, _alike(_spaces(parts, linear, extras)))
    missing = [i for i, c in enumerate(found) if c.verdict == "missing"]
    best = max(missing, key=lambda i: found[i].evidence, default=0)
    for i in missing:
        if i != best and judge.explains(looked[best], looked[i]):
            found[i] = replace(found[i], explained_by=found[best].hypothesis.label)
    return sorted(found, key=lambda c: -c.evidence)


def _ties(result: Calibrated, poses: LinearPoses | None) -> tuple[Array, Array]:
    """Information and slope of the cost by priors and known distances."""
    if poses is not None:
        return poses.tied, poses.pull
    assert result.frequency is not None
    robot, names = result.robot, result.frequency.names
    return prior_information(robot, names), prior_pull(robot, names)


def _with_responses(
    judge: EffectJudge, columns: ResponseColumns, hypothesis: ArmHypothesis, extra: Mapping[str, Array], looks: int
) -> tuple[dict[str, Array], int]:
    """The columns of an effect with those in the responses; a spring is the best one of some."""
    if not hypothesis.kind.soft:
        return {**extra, FREQUENCY: columns.of(hypothesis)}, looks
    tried = [{**extra, FREQUENCY: columns.of(hypothesis, k)} for k in STIFFNESSES]
    return max(tried, key=lambda each: judge.score(hypothesis, each)), looks * len(STIFFNESSES)


def _needs_poses(hypothesis: ArmHypothesis, shaken: Sequence[str]) -> bool:
    """Whether frequency responses alone have nothing to say: no motion, or waves, of which they see a scale."""
    moves = (
        hypothesis.kind.soft
        or hypothesis.owner in (*shaken, "robot")
        or hypothesis.kind.id in ("link_mass", "inertia_error")
    )
    waves = bool(hypothesis.kind.orders) or hypothesis.kind.parts == WAVES
    return FREQUENCY in hypothesis.kind.unseen or waves or not moves


def _spaces(parts: Sequence[LinearKind], linear: LinearKinds, extras: Sequence[Mapping[str, Array]]) -> list[Array]:
    """What is left of the columns of each effect in some kinds when all else may explain them."""
    root = np.linalg.cholesky(linear.tied).T
    basis = np.linalg.qr(np.vstack([*(part.J for part in parts), root]))[0]
    found = []
    for extra in extras:
        k = next((extra[part.kind].shape[1] for part in parts if part.kind in extra), 0)
        wide = [extra.get(part.kind, np.zeros((len(part.r), k))) for part in parts]
        found.append(_left(basis, np.vstack([*wide, np.zeros((len(root), k))])))
    return found


def _left(basis: Array, wide: Array) -> Array:
    """Orthonormal basis of what is left of columns."""
    U, s, _ = np.linalg.svd(wide - basis @ (basis.T @ wide), full_matrices=False)
    return np.asarray(U[:, s > 1e-9 * max(float(s.max(initial=0.0)), 1e-300)])


def _alike(spaces: Sequence[Array]) -> list[list[int]]:
    """Numbers of the spaces that each one is nearly in line with."""
    return [
        [j for j, other in enumerate(spaces) if j != i and _overlap(one, other) > ALIKE] for i, one in enumerate(spaces)
    ]


def _overlap(one: Array, other: Array) -> float:
    """Largest correlation of two spaces."""
    if not one.size or not other.size:
        return 0.0
    return float(np.linalg.svd(one.T @ other, compute_uv=False).max())
