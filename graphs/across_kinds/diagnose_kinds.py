# SPDX-License-Identifier: BSD-3-Clause
"""What a model lacks, asked of recordings of several kinds: each is judged in its own graph, then all are put together.

Poses and frequency responses are one graph; motion and rests have one each, because a search begins with models that
are wrong: values that one kind bends to hide an effect would look like other effects in the next.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings
from jointscope.graphs.across_kinds.said_by_kinds import (
    MOTION,
    RESTS,
    AcrossKinds,
    Said,
    across_kinds,
    said_by_arm,
    said_by_motion,
    said_by_rests,
    unseen_by_arm,
)
from jointscope.graphs.calibration.base_model import BaseModel
from jointscope.graphs.discovery.diagnose import diagnose
from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.graphs.discovery.side_by_side import solver_of
from jointscope.graphs.discovery.starting_model import starting_model
from jointscope.graphs.joint_kinds.arm_candidates import Calibrated
from jointscope.graphs.joint_kinds.discover_arm import diagnosed
from jointscope.graphs.joint_kinds.effect_judge import ArmCandidate
from jointscope.graphs.joint_kinds.likeliest_effect import calibrated
from jointscope.graphs.joint_kinds.spring_screen import badly_explained
from jointscope.graphs.rest_search.discover_rests import RestDiscovery, diagnose_rests
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.robots.geometry.arm_effects import FREQUENCY
from jointscope.robots.model.robot import Robot


@dataclass(frozen=True)
class KindsDiagnosis:
    """What is missing in several kinds of recordings.

    Attributes:
        robot: as given.
        candidates: all effects, best first.
        motion: of the recordings of motion; None without.
        arm: of poses and frequency responses; empty without.
        arm_kinds: which of these there are.
        arm_base: the model calibrated with these; None without.
        rests: of the rests; None without.
        motion_base: the model calibrated with motion; None without.
    """

    robot: Robot
    candidates: tuple[AcrossKinds, ...]
    motion: Diagnosis | None
    arm: tuple[ArmCandidate, ...]
    arm_kinds: tuple[str, ...]
    arm_base: Calibrated | None
    rests: RestDiscovery | None
    motion_base: BaseModel | None = None

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of recordings that were asked."""
        motion, rests = (MOTION,) if self.motion else (), (RESTS,) if self.rests else ()
        return (*motion, *self.arm_kinds, *rests)

    def order_of(self, kind: str) -> tuple[str, ...]:
        """Labels of all effects in the order in which a kind has them, best first."""
        if kind == MOTION:
            return tuple(c.label for c in self.motion.candidates) if self.motion is not None else ()
        if kind == RESTS:
            return tuple(c.label for c in self.rests.candidates) if self.rests is not None else ()
        return tuple(c.hypothesis.label for c in self.arm)

    @property
    def adequate(self) -> bool:
        """Whether no kind lacks anything."""
        return (self.motion is None or self.motion.adequate) and not any(c.shown_by for c in self.candidates)


def diagnose_kinds(
    robot: Robot,
    given: KindsRecordings,
    held: KindsRecordings | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> KindsDiagnosis:
    """Ranks the effects that a model lacks in recordings of several kinds.

    Args:
        robot: with what each of the kinds needs.
        given: recordings for training.
        held: those that are scored and never choose.
        progress: called with a text and the share done.
        options: of `diagnose`, for the recordings of motion.

    Raises:
        RecordingError: what is held out is also for training.
        JointscopeError: as of `diagnose`, `calibrate_kinds` and `diagnose_rests`.
    """
    held = held or KindsRecordings()
    given.must_be_apart(held)
    return ask_kinds(robot, given, held, progress or (lambda text, share: None), options)


@in_solver_context
def ask_kinds(
    robot: Robot,
    given: KindsRecordings,
    held: KindsRecordings,
    report: Progress,
    options: Mapping[str, Any],
    before: KindsDiagnosis | None = None,
    again: Collection[str] = (),
) -> KindsDiagnosis:
    """Asks each kind in its own graph.

    Args:
        robot: the model.
        given: recordings for training.
        held: those that are scored and never choose.
        report: called with a text and the share done.
        options: of `diagnose`, for the recordings of motion.
        before: what was said of a model of the same recordings whose values are near.
        again: kinds in which this model is another one than that of `before`; the others have said all that they have
            to say.
    """

    def anew(*kinds: str) -> bool:
        return before is None or any(kind in again for kind in kinds)

    kinds = given.of_arm
    arm = before.arm if before else ()
    base = before.arm_base if before else None
    if kinds and anew(*kinds):
        report("poses and frequency responses", 0.0)
        base = calibrated(robot, given.poses, given.shaken, near=before is not None and FREQUENCY in kinds)
        arm = tuple(diagnosed(base, given.poses, given.shaken, lambda text, share: report(text, 0.2 * share)))
    at_rest = before.rests if before else None
    if given.rests and anew(RESTS):
        at_rest = diagnose_rests(robot, given.rests, held.rests, lambda text, share: report(text, 0.2))
    motion, motion_base = (before.motion, before.motion_base) if before else (None, None)
    if given.motion and anew(MOTION):
        motion, motion_base = _moving(robot, given, held, report, options, motion_base)
    return KindsDiagnosis(
        robot, _together(motion, arm, kinds, at_rest, base), motion, arm, kinds, base, at_rest, motion_base
    )


def _moving(
    robot: Robot,
    given: KindsRecordings,
    held: KindsRecordings,
    report: Progress,
    options: Mapping[str, Any],
    near: BaseModel | None,
) -> tuple[Diagnosis, BaseModel]:
    """What the recordings of motion say, and the model calibrated with them."""
    solver = solver_of(options.get("side_by_side"))
    report("calibrating with motion", 0.3)
    if near is None:
        base = starting_model(robot, given.motion, solver)
    else:
        base = BaseModel.of(robot, given.motion, near, follow=True, solver=solver)
    later = {"base": base, "progress": lambda text, share: report(text, 0.3 + 0.7 * share)}
    holdout = held.motion[0] if held.motion else None
    return diagnose(base.robot, given.motion, holdout, **{**options, **later}), base


def _together(
    motion: Diagnosis | None,
    arm: Sequence[ArmCandidate],
    kinds: Sequence[str],
    at_rest: RestDiscovery | None,
    base: Calibrated | None,
) -> tuple[AcrossKinds, ...]:
    """All effects, from what each kind says."""
    said: dict[str, dict[str, Said]] = {} if motion is None else {MOTION: said_by_motion(motion)}
    shaken = None if base is None else base.frequency
    said |= said_by_arm(arm, kinds, shaken is None or not badly_explained(shaken.explained))
    if at_rest is not None:
        said[RESTS] = said_by_rests(at_rest.candidates)
    others = [label for kind, each in said.items() if kind not in kinds for label in each]
    for kind, each in unseen_by_arm(others, kinds).items():
        said[kind] = said[kind] | {label: nothing for label, nothing in each.items() if label not in said[kind]}
    return across_kinds(said)
