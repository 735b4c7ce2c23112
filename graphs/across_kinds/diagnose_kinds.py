# SPDX-License-Identifier: BSD-3-Clause
"""What a model lacks, asked of recordings of several kinds: each is judged in its own graph, then all are put together.

Poses and frequency responses are one graph; motion and rests have one each, because a search begins with models that
are wrong: values that one kind bends to hide an effect would look like other effects in the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

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
from jointscope.graphs.discovery.diagnose import diagnose
from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.graphs.joint_kinds.arm_candidates import Calibrated
from jointscope.graphs.joint_kinds.discover_arm import calibrated, diagnosed
from jointscope.graphs.joint_kinds.effect_judge import ArmCandidate
from jointscope.graphs.rest_search.discover_rests import RestDiscovery, diagnose_rests
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.robots.geometry.arm_effects import FREQUENCY, POSES
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.recordings.signals import Excitation, Signals
from jointscope.robots.rests.rests import Rests


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
    """

    robot: Robot
    candidates: tuple[AcrossKinds, ...]
    motion: Diagnosis | None
    arm: tuple[ArmCandidate, ...]
    arm_kinds: tuple[str, ...]
    arm_base: Calibrated | None
    rests: RestDiscovery | None

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of recordings that were asked."""
        motion, rests = (MOTION,) if self.motion else (), (RESTS,) if self.rests else ()
        return (*motion, *self.arm_kinds, *rests)

    @property
    def adequate(self) -> bool:
        """Whether no kind lacks anything."""
        return (self.motion is None or self.motion.adequate) and not any(c.shown_by for c in self.candidates)


def diagnose_kinds(
    robot: Robot,
    recordings: Sequence[Recording] = (),
    holdout: Recording | None = None,
    sessions: Sequence[Poses] = (),
    shaken: Sequence[tuple[Signals, Excitation]] = (),
    rests: Sequence[Rests] = (),
    rests_holdout: Sequence[Rests] = (),
    progress: Progress | None = None,
    **options: Any,
) -> KindsDiagnosis:
    """Ranks the effects that a model lacks in recordings of several kinds.

    Args:
        robot: with what each of the kinds needs.
        recordings: of motion.
        holdout: of motion; is scored and never chooses.
        sessions: poses, as of `calibrate_poses`.
        shaken: as of `calibrate_frequency`.
        rests: of each recording.
        rests_holdout: rests that are scored and never choose.
        progress: called with a text and the share done.
        options: of `diagnose`, for the recordings of motion.

    Raises:
        JointscopeError: as of `diagnose`, `calibrate_kinds` and `diagnose_rests`.
    """
    report = progress or (lambda text, share: None)
    said: dict[str, dict[str, Said]] = {}
    arm, kinds, base = list[ArmCandidate](), list[str](), None
    if sessions or shaken:
        report("poses and frequency responses", 0.0)
        base = calibrated(robot, sessions, shaken)
        arm = diagnosed(base, sessions, shaken, lambda text, share: report(text, 0.2 * share))
        kinds = [kind for kind, there in ((POSES, sessions), (FREQUENCY, shaken)) if there]
    at_rest = diagnose_rests(robot, rests, rests_holdout, lambda text, share: report(text, 0.2)) if rests else None
    motion = None
    if recordings:
        later = {"progress": lambda text, share: report(text, 0.3 + 0.7 * share)}
        motion = diagnose(robot, recordings, holdout, **(options | later))
        said[MOTION] = said_by_motion(motion)
    said |= said_by_arm(arm, kinds)
    if at_rest is not None:
        said[RESTS] = said_by_rests(at_rest.candidates)
    others = [label for kind, each in said.items() if kind not in kinds for label in each]
    for kind, each in unseen_by_arm(others, kinds).items():
        said[kind] = said[kind] | {label: nothing for label, nothing in each.items() if label not in said[kind]}
    return KindsDiagnosis(robot, across_kinds(said), motion, tuple(arm), tuple(kinds), base, at_rest)
