# SPDX-License-Identifier: BSD-3-Clause
"""What a model lacks, from rests alone: calibrated, judged, grown by the leading effect, until none is missing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.rest_search.rest_fits import fit_rests, folds_of
from jointscope.graphs.rest_search.rest_judge import Judged, RestCandidate, judge_rests
from jointscope.graphs.rest_sets.rest_errors import RestErrors, rest_errors
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.calibrate_rests import RestCalibration, calibrate_rests
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.rests.rests import Rests

Array = NDArray[np.float64]
Report = Callable[[str, float], None]
MOST_STEPS = 8
FEWEST = 8  # rests, from which some can be left out


@dataclass(frozen=True)
class RestStep:
    """One model on the way: what was added, its calibration, what it lacks."""

    added: RestCandidate | None
    result: RestCalibration
    judged: Judged


@dataclass(frozen=True)
class RestDiscovery:
    """All steps, why it ended, and rests that never chose.

    Attributes:
        steps: the base model first.
        stop_reason: why it ended; empty for a diagnosis.
        recordings, holdout: rests for training, and those held out.
    """

    steps: tuple[RestStep, ...]
    stop_reason: str
    recordings: tuple[Rests, ...]
    holdout: tuple[Rests, ...] = ()

    @property
    def robot(self) -> Robot:
        """The last model."""
        return self.steps[-1].result.robot

    @property
    def candidates(self) -> tuple[RestCandidate, ...]:
        """Of the last model."""
        return self.steps[-1].judged.candidates

    @property
    def adequate(self) -> bool:
        """Whether nothing is missing any more."""
        return not any(c.verdict == "missing" for c in self.candidates)

    @cached_property
    def errors_of_steps(self) -> tuple[tuple[RestErrors, RestErrors | None], ...]:
        """Errors of each step on rests for training, and on those held out; None without."""
        return tuple(
            (self.errors(step, self.recordings), self.errors(step, self.holdout) if self.holdout else None)
            for step in self.steps
        )

    def errors(self, step: RestStep, recordings: Sequence[Rests]) -> RestErrors:
        """Errors of a step's model on rests, in the sigmas of the last model, so that steps can be compared."""
        weight = self.steps[-1].result.problems[0].repeatability
        robot = step.result.robot
        return rest_errors([replace(RestSet.of(robot, rests), repeatability=weight) for rests in recordings])


def discover_rests(
    robot: Robot, recordings: Sequence[Rests], holdout: Sequence[Rests] = (), progress: Report | None = None
) -> RestDiscovery:
    """Grows a model effect by effect.

    Args:
        robot: with start values and priors.
        recordings: rests of each, for training.
        holdout: rests that are scored once per step and never choose.
        progress: called with a text and the share done.

    Raises:
        RecordingError: too few rests, or what is held out is also for training.
        SolveError: no convergence.
    """
    report = progress or (lambda text, share: None)
    _check(recordings, holdout)
    steps = [diagnosed(robot, recordings, report)]
    while steps[-1].judged.fit is not None and len(steps) <= MOST_STEPS:
        last = steps[-1].judged
        assert last.fit is not None and last.leading is not None
        report(f"calibrating with {last.leading.label}", len(steps) / (MOST_STEPS + 1))
        steps.append(diagnosed(last.fit.robot, recordings, report, last.fit.rests, last.leading))
    why = "no effect is significant and makes rests that were left out likelier"
    if steps[-1].judged.fit is not None:
        why = f"{MOST_STEPS} effects were added, the largest number allowed"
    return RestDiscovery(tuple(steps), why, tuple(recordings), tuple(holdout))


def diagnose_rests(
    robot: Robot, recordings: Sequence[Rests], holdout: Sequence[Rests] = (), progress: Report | None = None
) -> RestDiscovery:
    """Calibrates a model and judges all effects that it lacks; arguments as of `discover_rests`."""
    _check(recordings, holdout)
    step = diagnosed(robot, recordings, progress or (lambda text, share: None))
    return RestDiscovery((step,), "", tuple(recordings), tuple(holdout))


@in_solver_context
def diagnosed(
    robot: Robot,
    recordings: Sequence[Rests],
    report: Report,
    near: RestSet | None = None,
    added: RestCandidate | None = None,
) -> RestStep:
    """A model, calibrated, with what it lacks.

    Args:
        robot: the model.
        recordings: rests of each.
        report: called with a text and the share done.
        near: rests with the weights to begin with, where the values of the robot are near the end.
        added: the effect that it has since the step before.
    """
    result = calibrate_rests(robot, recordings, report, near)
    report("looking for effects", 0.5)
    # scales of torques are those of the values found, not of the start
    problems = [RestSet.of(result.likeliest, rests) for rests in recordings]
    weight = result.problems[0].repeatability
    whole = replace(RestSet.joined(problems), repeatability=weight, per_command=True, scoring=True)
    values = Calibration.of(result.likeliest).only([DYNAMICS])
    base = fit_rests(whole, np.concatenate(result.states), values)
    return RestStep(added, result, judge_rests(base, folds_of(recordings)))


def _check(recordings: Sequence[Rests], holdout: Sequence[Rests]) -> None:
    count = sum(map(len, recordings))
    if count < FEWEST:
        paths = ", ".join(rests.path for rests in recordings)
        raise RecordingError(
            f"{paths}: {count} rests; expected {FEWEST} or more, so that groups of them can be left out; let it "
            "rest in more postures or with other weights, or use `jointscope calibrate` and `jointscope compare`"
        )
    for held in holdout:
        for rests in recordings:
            if held is rests or (held.sha256 and held.sha256 == rests.sha256):
                raise RecordingError(
                    f"--holdout-rests {held.path} is also given with --rests ({rests.path}); hold out one that the "
                    "model has not seen"
                )
