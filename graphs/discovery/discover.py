# SPDX-License-Identifier: BSD-3-Clause
"""Calibrate, diagnose, add, calibrate ... until the model is adequate or nothing helps: forward selection with removal.

After every addition each effect that was added before is looked at again: one whose sizes fell back to null is taken
out. The held-out recording is scored once per step and never chooses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from jointscope.graphs.calibration.failures_with_notices import names_notices
from jointscope.graphs.discovery.diagnose import ADEQUATE, LEADERS
from jointscope.graphs.discovery.diagnosis_result import Candidate, Diagnosis
from jointscope.graphs.discovery.diagnosis_words import did_not_hold, rises_elsewhere, what_came_in, why_it_stopped
from jointscope.graphs.discovery.discovery_result import Discovery, DiscoveryStep, SavedStep, with_lasting_floors
from jointscope.graphs.discovery.search_kind import Errors, Kind, Motion
from jointscope.graphs.discovery.side_by_side import SideBySide
from jointscope.graphs.discovery.spring_trials import kept_by_predictions
from jointscope.graphs.discovery.starting_model import turns_over_sharper
from jointscope.graphs.discovery.unexplained import unexplained
from jointscope.graphs.discovery.verdicts import MATTERS, SAME, SURE
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.errors import JointscopeError
from jointscope.robots.files.effect_editing import remove_effect
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

MAX_STEPS = 8
HELD = " Its sizes are held as blocks left out have them: calibrated, they ran away."
NO_LESS = "leaves the missing torque of every joint as it was"
Save = Callable[[int, DiscoveryStep], str]


@in_solver_context
@names_notices
def discover(
    robot: Robot,
    recordings: Sequence[Recording],
    holdout: Recording | None = None,
    *,
    save: Save | None = None,
    resume: Sequence[SavedStep] | None = None,
    max_steps: int = MAX_STEPS,
    missing_torque: bool = True,
    side_by_side: SideBySide | None = None,
    progress: Progress | None = None,
) -> Discovery:
    """Finds the effects that a model lacks, one after the other.

    Args:
        robot: the base model.
        recordings: training recordings.
        holdout: scored once per step.
        save: called with the number of each finished step and the step; returns the robot file it wrote.
        resume: finished steps of an earlier run; the search goes on after the last.
        max_steps: effects to add at the most.
        missing_torque: estimate the missing torque at every step, too; pictures need it, no verdict does.
        side_by_side: who fits the candidates, if not this process alone.
        progress: called with a text and the share done, from 0 to 1.

    Raises:
        RecordingError: a recording cannot be a measurement of this robot.
        SolveError: the base model cannot be calibrated.
    """
    if side_by_side is not None:
        side_by_side.begin(LEADERS)
    kind = Motion(tuple(recordings), holdout, missing_torque, side_by_side)
    return search(kind, robot, holdout is not None, save, resume or (), max_steps, progress)


def search(
    kind: Kind,
    robot: Robot,
    held_out: bool,
    save: Save | None,
    resume: Sequence[SavedStep],
    max_steps: int,
    progress: Progress | None,
) -> Discovery:
    """Finds the effects that a model lacks in recordings of a kind; `held_out`: whether one chooses nothing."""
    return _Search(kind, held_out, save, progress or (lambda text, share: None), max_steps).run(robot, resume)


@dataclass(frozen=True)
class _Trial:
    """An effect that came in, the model before, what that lacked, its step, and whether the sizes were held."""

    candidate: Candidate
    base: Any
    diagnosis: Diagnosis
    step: DiscoveryStep
    held: bool = False


class _Search:
    """One discovery."""

    def __init__(self, kind: Kind, held_out: bool, save: Save | None, report: Progress, max_steps: int):
        self.kind, self.held_out, self.save, self.report = kind, held_out, save, report
        self.max_steps, self.steps = max_steps, list[DiscoveryStep]()
        self.last_errors: Errors | None = None  # of the last step; unknown after a resumed one

    def run(self, robot: Robot, resume: Sequence[SavedStep]) -> Discovery:
        """All steps."""
        for saved in resume:
            self._restore(saved)
        self.report("calibrating the base model", 0.0)
        base = self.kind.calibrated(self.steps[-1].robot if self.steps else robot)
        if not self.steps:
            sharper = turns_over_sharper(robot, base.robot)
            self._add_step(None, None, base, f"The base model. {sharper}".strip(), self.kind.errors(base))
        stop, diagnosis = self._loop(base)
        last = self.steps[-1]
        adequate = diagnosis.adequate if diagnosis is not None else unexplained(last.comparison) < ADEQUATE
        return Discovery(with_lasting_floors(self.steps), stop, adequate, last.robot_file, self.held_out)

    def _loop(self, base: Any) -> tuple[str, Diagnosis | None]:
        refused: dict[str, str] = {}
        trial: _Trial | None = None
        while True:
            added = sum(step.added is not None for step in self.steps) - len(self._taken_back())
            share = added / self.max_steps
            barred, now = frozenset(refused), self.steps[-1].comparison
            diagnosis = self.kind.diagnosed(base, now, self.last_errors, self._part(share), barred)
            self._attach(diagnosis)
            if trial is not None and (_torque_fell(trial.diagnosis, diagnosis) or self._predicts(trial)):
                refused = {}
            elif trial is not None:
                self._take_back(trial)
                base, diagnosis, added = trial.base, trial.diagnosis, added - 1
                grown = None if trial.held else self._try(base, trial.candidate, diagnosis, refused, held=True)
                if grown is not None:
                    trial, base = replace(trial, held=True), grown
                    continue
            there = {here.label for here in base.robot.effects}
            refused |= {label: NO_LESS for label in self._taken_back() if label not in there}
            chosen = [c for c in diagnosis.candidates if c.verdict == "missing" and c.label not in refused]
            if chosen and added >= self.max_steps:
                return f"{self.max_steps} effects were added, the largest number allowed", diagnosis
            tries = ((c, g) for c in chosen if (g := self._try(base, c, diagnosis, refused)) is not None)
            candidate, grown = next(tries, (None, None))
            if candidate is None and diagnosis.missing_torque_percent is not None and not refused.keys() <= barred:
                trial = None  # what explains less than one that did not hold may be right
                continue
            if candidate is None:
                held = not refused or diagnosis.adequate
                return why_it_stopped(diagnosis) if held else did_not_hold(refused), diagnosis
            trial = _Trial(candidate, base, diagnosis, self.steps[-2])
            base = self._without_idle(grown)

    def _try(
        self, base: Any, candidate: Candidate, diagnosis: Diagnosis, refused: dict[str, str], held: bool = False
    ) -> Any:
        """The model with a candidate, calibrated with all training recordings; None, and why, if that is no better.

        With `held` its sizes stay as they were judged.
        """
        self.report(f"adding {candidate.label}", len(self.steps) / (self.max_steps + 1))
        try:
            refit = diagnosis.refits[candidate.label]
            grown = self.kind.calibrated(_holding(refit, candidate) if held else refit, base)
            errors = self.kind.errors(grown)
        except JointscopeError as err:
            refused[candidate.label] = f"cannot be calibrated ({err})"
            return None
        before = self.steps[-1].train_error
        # how much it explains left-out blocks said of the torque, not predictions in sigmas of a fine sensor; but what
        # makes these worse, fitted to all of them, stands in for something else
        by_torques = diagnosis.missing_torque_percent is not None
        most = (1.0 + SAME) ** 2 if by_torques else 1.0 - self.kind.must_explain
        if not errors.error**2 < most * before**2:
            way = "raises the training error to" if errors.error > before else "leaves the training error at"
            refused[candidate.label] = f"{way} {errors.error:.3g} sigma ({before:.3g} before)"
            return None
        paragraph = what_came_in(candidate, grown.robot, before, errors.error)
        self._add_step(candidate.label, None, grown, f"{paragraph}{HELD if held else ''}", errors)
        return grown

    def _predicts(self, trial: _Trial) -> bool:
        return kept_by_predictions(trial.candidate, trial.step.train_error, self.steps[-1].train_error)

    def _without_idle(self, base: Any) -> Any:
        """Takes out effects whose sizes fell back to null after another one came in."""
        found_before = {step.added for step in self.steps[:-1]}
        for here in base.robot.effects:
            if here.label not in found_before or not _is_idle(base.robot, here):
                continue
            try:
                smaller = self.kind.calibrated(remove_effect(base.robot, here.label), base)
                errors = self.kind.errors(smaller)
            except JointscopeError:
                continue
            if errors.error**2 <= (1.0 + MATTERS) * self.steps[-1].train_error ** 2:
                self._add_step(None, here.label, smaller, f"{here.label} fell back to null and was taken out.", errors)
                base = smaller
        return base

    def _taken_back(self) -> list[str]:
        """Effects that left right after they came in, which are not tried again; idle ones had come in earlier."""
        pairs = pairwise(self.steps)
        return [step.removed for before, step in pairs if step.removed is not None and step.removed == before.added]

    def _take_back(self, trial: _Trial) -> None:
        """The model before an effect came in, as one more step."""
        label = trial.candidate.label
        paragraph = f"{label} {NO_LESS}, and was taken out."
        step = replace(trial.step, added=None, removed=label, paragraph=paragraph, robot_file="")
        if self.save is not None:
            step = replace(step, robot_file=self.save(len(self.steps), step))
        self.steps.append(step)
        self.last_errors = None

    def _add_step(self, added: str | None, removed: str | None, base: Any, paragraph: str, errors: Errors) -> None:
        comparison = self.kind.compared(f"step {len(self.steps)}", base.robot)
        if self.held_out and added is not None:
            paragraph += rises_elsewhere(self.steps[-1].heldout_error, comparison.judged_error)
        step = DiscoveryStep(
            added=added,
            removed=removed,
            robot=base.robot,
            train_error=errors.error,
            heldout_error=comparison.judged_error if self.held_out else float("nan"),
            floor=self.kind.floor(comparison),
            diagnosis=None,
            comparison=comparison,
            paragraph=paragraph,
        )
        if self.save is not None:
            step = replace(step, robot_file=self.save(len(self.steps), step))
        self.steps.append(step)
        self.last_errors = errors

    def _restore(self, saved: SavedStep) -> None:
        comparison = self.kind.compared(f"step {len(self.steps)}", saved.robot)
        self.steps.append(
            DiscoveryStep(
                added=saved.added,
                removed=saved.removed,
                robot=saved.robot,
                train_error=saved.train_error,
                heldout_error=saved.heldout_error,
                floor=saved.floor,
                diagnosis=None,
                comparison=comparison,
                robot_file=saved.robot_file,
                paragraph=saved.paragraph,
            )
        )

    def _attach(self, diagnosis: Diagnosis) -> None:
        """The last step learns what was found with it as the base."""
        self.steps[-1] = replace(self.steps[-1], diagnosis=diagnosis)

    def _part(self, start: float) -> Progress:
        width = 1.0 / (self.max_steps + 1)
        return lambda text, share: self.report(text, min(start + width * share, 1.0))


def _holding(robot: Robot, candidate: Candidate) -> Robot:
    """The robot with all numbers of a candidate fixed as they were judged, with the sigmas found there."""
    start, parameters = f"{candidate.owner}.{candidate.effect}.", dict(robot.parameters)
    for name, p in robot.parameters.items():
        if name.startswith(start):
            judged = candidate.parameters.get(name.removeprefix(start))
            parameters[name] = replace(p, fixed=True, sigma=judged.sigma if judged is not None else None)
    return replace(robot, parameters=parameters)


def _torque_fell(before: Diagnosis, after: Diagnosis) -> bool:
    """Whether an effect, once calibrated with all data, takes from some joint's missing torque what effects must.

    True where models are not judged by torques: there the training error has decided.
    """
    missing, left = before.missing_torque_percent, after.missing_torque_percent
    if missing is None or left is None:
        return True
    return any(left[j] ** 2 < (1.0 - MATTERS) * value**2 for j, value in missing.items() if j in left)


def _is_idle(robot: Robot, here: EffectAt) -> bool:
    """Whether every size of an effect is free and compatible with its null value."""
    sizes = [p for p in here.effect.parameters_at(robot, here.owner) if not p.is_shape]
    values = [robot.parameters[here.parameter(p.name)] for p in sizes]
    return bool(sizes) and all(
        not v.fixed and v.sigma is not None and abs(v.value - p.null) < SURE * v.sigma
        for p, v in zip(sizes, values, strict=True)
    )
