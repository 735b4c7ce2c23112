# SPDX-License-Identifier: BSD-3-Clause
"""What a model lacks, from recordings of several kinds: one model grown effect by effect, calibrated in one graph.

In every round each kind says in its own graph what it lacks, judged on groups of its recordings that were left out. The
first effect of a kind that no other kind speaks against, with the most evidence of all kinds together, comes into the
one model. It stays if the graph of all recordings then leaves less in a kind that shows it, and no more in any other
that could. Kinds in which an effect does nothing are not asked again: their model is the same.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from jointscope.graphs.across_kinds.diagnose_kinds import KindsDiagnosis, ask_kinds
from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings
from jointscope.graphs.across_kinds.said_by_kinds import MOTION, RESTS, AcrossKinds
from jointscope.graphs.across_kinds.shared_effect import own_names, with_shared_effect, without_shared_effect
from jointscope.graphs.across_kinds.shared_model import (
    SharedModel,
    calibrate_shared,
    errors_by_kind,
    heldout_by_kind,
)
from jointscope.graphs.across_kinds.trials import Trial, Trials
from jointscope.graphs.discovery.side_by_side import solver_of
from jointscope.graphs.discovery.verdicts import MATTERS, SAME, SURE
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.robots.errors import JointscopeError, RecordingError
from jointscope.robots.geometry.arm_effects import POSES
from jointscope.robots.model.robot import Robot

MOST_STEPS = 8
NOISE = {MOTION: 1.0, POSES: 1.0}  # [sigma] error that noise alone leaves; of other kinds errors are shares
NOTHING_LEFT = "no kind of recordings shows an effect that the others do not speak against"


@dataclass(frozen=True)
class KindsStep:
    """One model on the way.

    Attributes:
        added: what came in, as all kinds saw it before; None for the base model.
        removed: label of what was taken out; "" of nothing.
        model: calibrated with all recordings.
        found: what each kind says that this model lacks.
    """

    added: AcrossKinds | None
    removed: str
    model: SharedModel
    found: KindsDiagnosis


@dataclass(frozen=True)
class KindsDiscovery:
    """All steps, and why it ended.

    Attributes:
        steps: the base model first.
        stop_reason: why it ended.
        given: recordings for training.
        held: recordings that never chose.
    """

    steps: tuple[KindsStep, ...]
    stop_reason: str
    given: KindsRecordings
    held: KindsRecordings

    @property
    def robot(self) -> Robot:
        """The last model."""
        return self.steps[-1].model.robot

    @property
    def adequate(self) -> bool:
        """Whether no kind lacks anything any more."""
        return self.steps[-1].found.adequate

    @cached_property
    def errors(self) -> tuple[tuple[Mapping[str, float], Mapping[str, float]], ...]:
        """By kind, of each step for training and held out, in sigmas of the last model's noise."""
        last = self.steps[-1].model
        return tuple(
            (errors_by_kind(step.model, self.given, last), heldout_by_kind(step.model, self.held, last))
            for step in self.steps
        )


@in_solver_context
def discover_kinds(
    robot: Robot,
    given: KindsRecordings,
    held: KindsRecordings | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> KindsDiscovery:
    """Grows one model by what recordings of several kinds say.

    Args:
        robot: with what each of the kinds needs.
        given: recordings for training.
        held: those that are scored once per step and never choose.
        progress: called with a text and the share done.
        options: of `diagnose`, for the recordings of motion.

    Raises:
        RecordingError: kinds that do not need more than one graph, or what is held out is also for training.
        JointscopeError: as of `diagnose_kinds` and `calibrate_shared`.
    """
    if len(given.kinds) == len(given.of_arm) or len(given.kinds) == 1:
        raise RecordingError(
            "recordings of one graph: call discover for motion, discover_rests for rests, discover_arm for poses and "
            "frequency responses"
        )
    held = held or KindsRecordings()
    given.must_be_apart(held)
    return _Search(given, held, progress or (lambda text, share: None), options).run(robot)


class _Search:
    """One discovery."""

    def __init__(self, given: KindsRecordings, held: KindsRecordings, report: Progress, options: Mapping[str, Any]):
        self.given, self.held, self.report = given, held, report
        self.options = {"each_held_out": False, **options}
        self.solver = solver_of(options.get("side_by_side"))
        self.steps: list[KindsStep] = []
        self._known: dict[int, tuple[SharedModel, dict[str, float]]] = {}

    def run(self, robot: Robot) -> KindsDiscovery:
        """All steps."""
        found = ask_kinds(robot, self.given, self.held, self._part(), self.options)
        begun = found.motion_base.robot if found.motion_base is not None else robot
        self.steps.append(KindsStep(None, "", self._calibrated(begun, found), found))
        while True:
            refused: dict[str, str] = {}
            grown = self._grown(refused)
            if grown is None:
                return KindsDiscovery(tuple(self.steps), self._why(refused), self.given, self.held)
            self._add(*grown)
            self._without_idle()

    def _grown(self, refused: dict[str, str]) -> tuple[AcrossKinds, SharedModel] | None:
        """The effect that comes in, and the model with it; None, and why, where none does."""
        last = self.steps[-1]
        if self._added >= MOST_STEPS:
            return None
        trials = Trials(self.given, last.model, self._part(), self.solver)
        while (candidate := leading(last.found, refused)) is not None:
            label = candidate.label
            self.report(f"calibrating all kinds with {label}", 0.9)
            try:
                trial = trials.of(_with(last, candidate))
                worse = self._why_not(candidate, trial)
                if not worse and not trial.model.settled:
                    trial = trials.settled(trial)
                    worse = self._why_not(candidate, trial)
                if not worse:
                    return candidate, trial.model
            except JointscopeError as err:
                worse = f"cannot be calibrated with all kinds ({err})"
            refused[label] = worse
        return None

    def _why_not(self, candidate: AcrossKinds, trial: Trial) -> str:
        """What speaks against an effect once all kinds are in one graph, by errors; empty if nothing does."""
        last = self.steps[-1]
        # kinds that cannot show it may give way while they lack something else: they have no say
        told = [kind for kind in candidate.seen_by if not _by_friction(kind, self.given)]
        was = self._errors(trial.beside, told)
        now = errors_by_kind(trial.model, self.given, last.model, told)
        # what is within its noise is as good as it was: the values of other kinds move it by chance
        most = {kind: max((1.0 + SAME) * was[kind], NOISE.get(kind, 0.0)) for kind in told}
        worse = [kind for kind in told if now[kind] > most[kind]]
        if worse:
            kind = worse[0]
            return f"raises the error in {kind} from {was[kind]:.3g} to {now[kind]:.3g}"
        judged = [k for k in told if k in candidate.shown_by and not _by_torques(k, last.found)]
        better = [kind for kind in judged if now[kind] ** 2 < (1.0 - MATTERS) * was[kind] ** 2]
        if judged and not better:
            return f"leaves the error in {' and '.join(judged)} as it was"
        return ""

    def _errors(self, model: SharedModel, kinds: Collection[str]) -> dict[str, float]:
        """Of a model beside which others are tried, worked out once per kind."""
        known = self._known.setdefault(id(model), (model, {}))[1]
        known |= errors_by_kind(model, self.given, self.steps[-1].model, [k for k in kinds if k not in known])
        return known

    def _add(self, candidate: AcrossKinds, model: SharedModel) -> None:
        found = self._asked(model, candidate.seen_by)
        self.steps.append(KindsStep(candidate, "", model, found))

    def _without_idle(self) -> None:
        """Takes out an effect that came in earlier and whose sizes fell back to null."""
        for k, step in enumerate(self.steps[1:-1], start=1):
            if step.added is None or step.added.label in [each.removed for each in self.steps]:
                continue
            last, before = self.steps[-1], self.steps[k - 1].model.robot
            if not _is_idle(last.model.robot, own_names(step.model.robot, before), step.added.label):
                continue
            try:
                smaller = without_shared_effect(last.model.robot, step.added.label, before)
                model = Trials(self.given, last.model, self._part(), self.solver).smaller(smaller)
            except JointscopeError:
                continue
            if not self._raised(last.model, model):
                found = self._asked(model, step.added.seen_by)
                self.steps.append(KindsStep(None, step.added.label, model, found))

    def _raised(self, before: SharedModel, after: SharedModel) -> bool:
        was, now = (errors_by_kind(model, self.given, before) for model in (before, after))
        return any(now[kind] ** 2 > (1.0 + MATTERS) * was[kind] ** 2 for kind in was)

    def _calibrated(self, robot: Robot, found: KindsDiagnosis) -> SharedModel:
        return calibrate_shared(robot, self.given, found.motion_base, self._part(), self.solver)

    def _asked(self, model: SharedModel, again: Collection[str]) -> KindsDiagnosis:
        before = self.steps[-1].found
        return ask_kinds(model.robot, self.given, self.held, self._part(), self.options, before, again)

    @property
    def _added(self) -> int:
        return sum(step.added is not None for step in self.steps) - sum(bool(step.removed) for step in self.steps)

    def _why(self, refused: Mapping[str, str]) -> str:
        if self._added >= MOST_STEPS:
            return f"{MOST_STEPS} effects were added, the largest number allowed"
        if refused:
            each = "; ".join(f"{label} {why}" for label, why in refused.items())
            return f"what is left did not hold in one graph: {each}"
        return NOTHING_LEFT

    def _part(self) -> Progress:
        """Progress of one round among those that may come."""
        width = 1.0 / (MOST_STEPS + 1)
        start = min(len(self.steps) * width, 1.0 - width)
        return lambda text, share: self.report(text, start + width * share)


def leading(found: KindsDiagnosis, refused: Collection[str] = ()) -> AcrossKinds | None:
    """The effect to add: the first that a kind misses, of these the one with the most evidence; None without."""
    missing = {c.label: c for c in found.candidates if c.verdict == "missing" and c.label not in refused}
    first: dict[str, AcrossKinds] = {}
    for kind in found.kinds:
        shown = [c for label in found.order_of(kind) if (c := missing.get(label)) is not None and kind in c.shown_by]
        first |= {shown[0].label: shown[0]} if shown else {}
    return max(first.values(), key=lambda c: c.evidence, default=None)


def _with(step: KindsStep, candidate: AcrossKinds) -> Robot:
    """The model of a step with an effect."""
    found = step.found
    hypothesis = next((c.hypothesis for c in found.arm if c.hypothesis.label == candidate.label), None)
    refit = None
    if found.motion is not None and MOTION in candidate.shown_by:
        refit = found.motion.refits.get(candidate.label)
    return with_shared_effect(step.model.robot, candidate, hypothesis, refit)


def _by_torques(kind: str, found: KindsDiagnosis) -> bool:
    """Whether motion is judged by torques: predictions in sigmas of a fine sensor then only must not be worse."""
    return kind == MOTION and found.motion is not None and found.motion.missing_torque_percent is not None


def _by_friction(kind: str, given: KindsRecordings) -> bool:
    """Whether rests of motors alone are asked, where a wider band of friction hides what is missing."""
    return kind == RESTS and given.rests[0].q_link is None


def _is_idle(robot: Robot, names: Collection[str], label: str) -> bool:
    """Whether every size of an effect is free and compatible with zero; one that must be positive never is."""
    effect = label.partition("@")[0]
    own = [robot.parameters[name] for name in names if name in robot.parameters]
    sizes = [p for p in own if p.effect == effect and not p.positive and (p.null is not None or p.prior == 0.0)]
    return bool(sizes) and all(
        not p.fixed and p.sigma is not None and abs(p.value - (p.null or 0.0)) < SURE * p.sigma for p in sizes
    )
