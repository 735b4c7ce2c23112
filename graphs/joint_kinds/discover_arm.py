# SPDX-License-Identifier: BSD-3-Clause
"""What a model of an arm lacks, from poses, frequency responses or both: effects are added as long as one is missing.

Every step calibrates the model with all recordings in one graph and judges all effects that it lacks, from one linear
system. Where frequency responses are among the recordings, a step of a spring or a gap is no small one, so the leading
effects are calibrated for real, and the one that makes the recordings likeliest is added.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.frequency.compare_frequency import FrequencyErrors, frequency_errors
from jointscope.graphs.frequency.settled_stages import must_explain
from jointscope.graphs.joint_kinds.arm_candidates import Calibrated, arm_candidates
from jointscope.graphs.joint_kinds.effect_judge import ArmCandidate
from jointscope.graphs.joint_kinds.likeliest_effect import calibrated, leading_effects, likeliest_effect
from jointscope.graphs.joint_kinds.spring_screen import badly_explained, screened_springs
from jointscope.graphs.poses.calibrate_poses import PoseCalibration
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.tip_errors import TipErrors, summary, tip_errors, whitened
from jointscope.graphs.poses.tracker_start import placed
from jointscope.robots.geometry.arm_effects import FREQUENCY, POSES
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses
from jointscope.robots.recordings.signals import Excitation, Signals

Array = NDArray[np.float64]
Shaken = tuple[Signals, Excitation]
Report = Callable[[str, float], None]
MOST_STEPS = 8


@dataclass(frozen=True)
class ArmStep:
    """One model on the way: what was added, its calibration, its errors where they were not fitted."""

    added: ArmCandidate | None
    calibrated: Calibrated
    heldout: TipErrors | None
    shaken: tuple[FrequencyErrors, ...]
    candidates: tuple[ArmCandidate, ...]

    @property
    def result(self) -> PoseCalibration:
        """The calibration of the poses, where there are any."""
        assert self.calibrated.poses is not None
        return self.calibrated.poses

    @property
    def left(self) -> float:
        """Share of the torques that the model leaves where the arm was shaken, rms."""
        assert self.calibrated.frequency is not None
        return _rms([pose.left for pose in self.calibrated.frequency.explained.poses])

    @property
    def left_heldout(self) -> float:
        """The same in recordings that never chose."""
        return _rms([errors.fit.left for errors in self.shaken])


@dataclass(frozen=True)
class ArmDiscovery:
    """All steps, why it ended, and the recordings that never chose."""

    steps: tuple[ArmStep, ...]
    stop_reason: str
    holdout: tuple[PoseSet, ...] = ()

    @property
    def robot(self) -> Robot:
        """The last model."""
        return self.steps[-1].calibrated.robot

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of the recordings."""
        last = self.steps[-1].calibrated
        return tuple(kind for kind, there in ((POSES, last.poses), (FREQUENCY, last.frequency)) if there is not None)

    def whitened(self, step: ArmStep, sessions: Sequence[PoseSet]) -> float:
        """Root mean square error of a model on poses, per coordinate [sigma of the last model's noise]; 1 is noise."""
        return whitened(step.calibrated.robot, self.robot.poses, sessions)


def discover_arm(
    robot: Robot,
    sessions: Sequence[Poses] = (),
    holdout: Sequence[Poses] = (),
    progress: Report | None = None,
    recordings: Sequence[Shaken] = (),
    shaken_holdout: Sequence[Shaken] = (),
) -> ArmDiscovery:
    """Grows a model effect by effect.

    Args:
        robot: with a section `poses`, `frequency`, or both.
        sessions: poses for training.
        holdout: poses that are scored once per step and never choose.
        progress: called with a text and the share done.
        recordings: of the arm shaken, for training.
        shaken_holdout: recordings that are scored once per step and never choose.

    Raises:
        As `calibrate_poses`, `calibrate_frequency` and `calibrate_kinds`.
    """
    report = progress or (lambda text, share: None)
    report("base model", 0.0)
    result = calibrated(robot, sessions, recordings)
    steps: list[ArmStep] = []
    added: ArmCandidate | None = None
    while True:
        report(f"looking for effect {len(steps) + 1}", len(steps) / (MOST_STEPS + 1))
        candidates, begins = candidates_of(result)
        leading = leading_effects(candidates)
        following = None
        if leading and len(steps) < MOST_STEPS:
            following = likeliest_effect(result, leading, begins, sessions, recordings, report)
            if following is None:
                candidates = [replace(c, verdict="possible") if c in leading else c for c in candidates]
        shaken = frequency_errors(result.robot, shaken_holdout) if shaken_holdout else ()
        steps.append(ArmStep(added, result, _heldout(result.robot, holdout), shaken, tuple(candidates)))
        if following is None:
            _must_be_explained(result)
            why = f"{MOST_STEPS} effects were added, the largest number allowed"
            if len(steps) <= MOST_STEPS:
                why = "no effect is significant and meets left-out recordings better"
                why = why.replace("recordings", "poses") if not recordings else why
            return ArmDiscovery(tuple(steps), why, tuple(placed(result.robot, holdout)[1]) if holdout else ())
        added, result = following


def scored(
    result: Calibrated, candidates: Sequence[ArmCandidate], holdout: Sequence[Poses], shaken: Sequence[Shaken]
) -> ArmDiscovery:
    """A diagnosis as a search that adds nothing, with the errors of its model on recordings that never chose.

    Args:
        result: the calibrated arm.
        candidates: what it may lack.
        holdout: poses that were held out.
        shaken: recordings of the arm shaken that were held out.
    """
    errors = frequency_errors(result.robot, shaken) if shaken else ()
    step = ArmStep(None, result, _heldout(result.robot, holdout), errors, tuple(candidates))
    return ArmDiscovery((step,), "", tuple(placed(result.robot, holdout)[1]) if holdout else ())


def diagnosed(
    result: Calibrated, sessions: Sequence[Poses], recordings: Sequence[Shaken], report: Report
) -> list[ArmCandidate]:
    """All effects that a calibrated arm lacks; where several are missing, as a model with the likeliest one sees them.

    Args:
        result: the calibrated arm.
        sessions: the poses that it is calibrated with.
        recordings: the same, shaken.
        report: called with a text and the share done.

    Raises:
        SolveError: responses of which neither the model nor any effect explains anything.
    """
    candidates, begins = candidates_of(result)
    missing = [c for c in candidates if c.verdict == "missing"]
    if not missing:
        _must_be_explained(result)
    following = (
        None
        if len(missing) < 2
        else likeliest_effect(result, leading_effects(candidates), begins, sessions, recordings, report)
    )
    if following is None:
        return [c.beside_the_best for c in candidates]
    first, other = following[0].hypothesis.label, following[1]
    report(f"looking for effects beside {first}", 0.95)
    still = {c.hypothesis.label for c in candidates_of(other)[0] if c.verdict == "missing"} | {first}
    gone = {c.hypothesis.label for c in missing} - still
    named = [replace(c, explained_by=first if c.hypothesis.label in gone else "") for c in candidates]
    return [c.beside_the_best for c in sorted(named, key=lambda c: c.hypothesis.label != first)]


def candidates_of(result: Calibrated) -> tuple[list[ArmCandidate], dict[str, Robot]]:
    """All effects that a calibrated arm lacks, best first, and robots that begin with one, by its label.

    Where a response is missing, springs of locked joints are put in and tried, too; the likeliest of them comes first,
    for nothing is known of the others before that is in the model.
    """
    candidates = arm_candidates(result)
    if result.frequency is None or not badly_explained(result.frequency.explained):
        return candidates, {}
    screened = screened_springs(result.frequency, candidates)
    known = {c.hypothesis.label: c for c, _ in screened}
    found = [known.get(c.hypothesis.label, c) for c in candidates]
    if screened:  # the slopes of all others are those at values that have no meaning
        first = screened[0][0].hypothesis.label
        found = [replace(c, explained_by="" if c.hypothesis.label == first else first) for c in found]
    return sorted(found, key=lambda c: -c.evidence), {c.hypothesis.label: robot for c, robot in screened}


def _must_be_explained(result: Calibrated) -> None:
    """Complains of responses of which the model explains nothing, where no effect does.

    Raises:
        SolveError: it leaves most of the torques.
    """
    if result.frequency is not None:
        must_explain(result.frequency.problems, Calibration.of(result.robot).only([DYNAMICS]))


def _heldout(robot: Robot, holdout: Sequence[Poses]) -> TipErrors | None:
    if not holdout:
        return None
    _, problems = placed(robot, holdout)
    return summary([tip_errors(problem) for problem in problems])


def _rms(parts: Sequence[Array]) -> float:
    return float(np.sqrt(np.mean(np.square(np.concatenate(parts)))))
