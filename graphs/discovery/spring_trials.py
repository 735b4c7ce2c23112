# SPDX-License-Identifier: BSD-3-Clause
"""Springs behind joints that were taken for rigid, tried by calibration.

One linear step from a rigid joint does not tell of its spring: the link that swings behind the motor has no states yet,
and the base parameters have taken what they could of it. So a joint that is far from explained is calibrated with one.

Springs of neighbouring joints take each other's part: alone, the first comes out too soft, and the second, which also
feels how the first one's link swings, seems softer than it is. So the second begins stiffer, too, and beside it the
first begins again where missing torque puts it, not where it had to stand for both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from jointscope.graphs.calibration.base_model import BaseModel, Span
from jointscope.graphs.discovery.diagnosis_result import Candidate
from jointscope.graphs.discovery.scored_candidates import ScoredCandidates
from jointscope.graphs.discovery.starting_model import torque_judge
from jointscope.graphs.discovery.torque_verdicts import TorqueVerdicts
from jointscope.graphs.discovery.verdicts import SAME, SURE, judge, yielding
from jointscope.graphs.judging.elastic_reaction import spring_hypotheses, spring_start
from jointscope.graphs.judging.torque_judge import NET, SMALL
from jointscope.graphs.refits.refit import Refit
from jointscope.graphs.refits.validated_refit import ValidatedRefit, judged_seconds, refit_and_validate
from jointscope.graphs.refits.validation import ValidationError, judged_error, reported_heldout_error
from jointscope.robots.errors import JointscopeError
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

SPRING = "joint_elasticity"
FAR = 10.0  # [%] of the drive's torque that is missing, [sigma] of the prediction, from which a joint is tried
MOST_TRIED = 2  # joints, those first of which most is missing
ALIKE = 1.5  # ratio of two compliances of the same spring, by missing torque and calibrated
WORSE = 1.5  # times the error of the rigid model that one with a spring may have
CLEAR = 0.5  # share of the squared error that a spring must explain to stand before torques
STIFFER = (1.0, 3.0, 9.0)  # times the stiffness that missing torque tells, where a calibration begins


@dataclass(frozen=True)
class SpringTrials:
    """Trials beside other candidates.

    Attributes:
        base: the rigid model.
        spans: pieces on which a model is fitted, and those on which it is judged.
        before: errors of the base model on the latter.
        holdout: scored and reported.
    """

    base: BaseModel
    spans: tuple[Sequence[Span], Sequence[Span]]
    before: ValidationError
    holdout: Recording | None

    def borne_out(
        self, torques: TorqueVerdicts | None, scored: ScoredCandidates
    ) -> tuple[Candidate | None, dict[str, Robot]]:
        """The spring that explains most of the missing torque, calibrated, and the robot with it.

        What a rigid model lacks told of it on blocks left out; calibrated from its start values it must come out as the
        same spring. Predictions a tenth of a second ahead do not have to be better: a torque that changes its sign
        within them leaves less there than what random torques add up to. With a spring that is not there they are much
        worse.

        Returns:
            The candidate, None where another one comes first; the robot by its label, none where it is no better.
        """
        first = None if torques is None else torques.candidates[0]
        if torques is None or first is None or first.effect != SPRING or first.verdict != "missing":
            return None, {}
        start = {name: estimate.value for name, estimate in first.parameters.items()}
        fitted = self._calibrated(first.label, start)
        if fitted is None:
            return first, {}
        seconds = judged_seconds(self.base, self.spans[1])
        judged = next(judge(c, self.before, fitted, seconds) for c in scored.candidates if c.label == first.label)
        spring = judged.parameters["compliance"]
        alike = abs(np.log(spring.value / start["compliance"])) < np.log(ALIKE)
        worse = fitted.validation.error > WORSE * self.before.error
        if not spring.value > SURE * spring.sigma or not alike or worse:
            return first, {}
        found = replace(judged, verdict="missing", score=first.score, dof=first.dof, share=first.share)
        found = replace(found, reasons=(*first.reasons, judged.reasons[0]), look_alikes=first.look_alikes)
        return found, {first.label: fitted.refit.robot}

    def beside(
        self,
        candidates: Sequence[Candidate],
        scored: ScoredCandidates,
        torques: Mapping[str, Robot],
        missing: Mapping[str, float],
    ) -> tuple[list[Candidate], dict[str, Robot]]:
        """All candidates with the verdicts on springs, and the robots with those.

        A clear spring that explains more than the first other one comes first. A stiff one takes little torque,
        averaged over many steps, and is yet most of what fine encoders see: where nothing else is missing they ask for
        a trial.

        Args:
            candidates: judged by other means, best first.
            scored: the same before they were judged.
            torques: robots with the effects that missing torque names.
            missing: torque of each joint in percent of the drive's; empty where predictions are judged.
        """
        far = self._far(missing)
        if missing and not far and not any(c.verdict == "missing" for c in candidates):
            far = self._far({})
        told = {c.label: c for c in candidates if c.effect == SPRING}
        tried = {label: self._fitted(label, told.get(label)) for label in (f"{SPRING}@{joint}" for joint in far)}
        if not tried:
            return list(candidates), {}
        seconds = judged_seconds(self.base, self.spans[1])
        springs = [
            _small_and_sure(judge(c, self.before, tried[c.label], seconds, tried[c.label] is None), told, self.before)
            for c in scored.candidates
            if c.label in tried
        ]
        refits = {label: fitted.refit.robot for label, fitted in tried.items() if fitted is not None}
        clear = [spring for spring in springs if spring.verdict == "missing" and _is_clear(spring, told)]
        best = min(clear, key=lambda spring: spring.validation_error, default=None)
        others = [c for c in candidates if c.label not in tried]
        first = next((c for c in others if c.verdict == "missing"), None)
        if best is not None and best.validation_error < self._rival(first, torques):
            return [best, *(yielding(c, best) for c in (*springs, *others) if c is not best)], refits
        return [
            *others,
            *(_doubted(spring, told) if first is None else yielding(spring, first) for spring in springs),
        ], refits

    def _far(self, missing: Mapping[str, float]) -> list[str]:
        """Joints to be tried, worst first."""
        robot = self.base.robot
        if len(robot.sensors) > 1 or robot.transmission is not None or robot.choices.link_dynamics != "model":
            return []
        channels = zip(robot.joints, robot.motor_encoder.channels, strict=True)
        far = missing or {joint: self.before.channels[name] for joint, name in channels}
        can = catalogue()[SPRING].owners_of(robot)
        return sorted((joint for joint in can if far[joint] > FAR), key=lambda joint: -far[joint])[:MOST_TRIED]

    def _calibrated(self, label: str, start: Mapping[str, float]) -> ValidatedRefit | None:
        """The model with a spring from its start values, calibrated with everything, as the rigid one was.

        Whether it is there was asked of blocks left out before; None where it cannot be calibrated.
        """
        try:
            elastic = self._elastic(label, start)
            errors = judged_error(elastic, elastic.robot, elastic.calibrations, self.spans[1])
        except (JointscopeError, np.linalg.LinAlgError):
            return None
        owner = label.split("@")[1]
        own = {name: elastic.robot.parameters[f"{owner}.{SPRING}.{name}"].sigma for name in start}
        sigmas = {name: float("nan") if sigma is None else sigma for name, sigma in own.items()}
        refit = Refit(elastic.robot, label, elastic.calibrations, sigmas, converged=True)
        return ValidatedRefit(refit, errors, reported_heldout_error(elastic.robot, self.holdout))

    def _elastic(self, label: str, start: Mapping[str, float]) -> BaseModel:
        """The model with a spring, calibrated for the measure by which the one without was judged."""
        grown = add_effect(self._start, label, dict(start))
        return BaseModel.of(grown, self.base.recordings, by_torques=self.base.by_torques)

    @cached_property
    def _start(self) -> Robot:
        """The model as it was before its calibration, its springs where missing torque alone puts them."""
        robot = self.base.result.start
        springs = [here for here in robot.effects if here.effect.id == SPRING]
        judge = torque_judge(self.base, with_springs=False) if springs else None
        if judge is None:
            return robot
        rigid, found = judge.equations.steps[0].segment.problem.robot, dict[str, float]()
        for here in springs:
            told = judge.judge(spring_hypotheses(here, judge.equations.period))
            if told is not None and told.net > NET:
                start = spring_start(rigid, told.hypothesis)
                found |= {here.parameter(name): value for name, value in start.items()}
        return robot.with_values(found)

    def _fitted(self, label: str, told: Candidate | None) -> ValidatedRefit | None:
        """The best of models with a spring of several stiffnesses at the start; None where none can be calibrated.

        They begin with what missing torque tells of it, if that is something; far from a stiff spring there are other
        minima. Where it says that the spring is there, stiffer ones are tried until one is clear, or no better.
        """
        start = {name: p.value for name, p in told.parameters.items()} if told is not None else {}
        there = told is not None and told.verdict != "absent" and "compliance" in start
        best: ValidatedRefit | None = None
        for factor in STIFFER if there else STIFFER[:1]:
            own = start | {"compliance": start["compliance"] / factor} if there else start
            asked = _is_most(told)  # of blocks left out; half of the data does not tell neighbouring springs apart
            fitted = self._calibrated(label, own) if asked else self._fitted_from(label, own)
            if fitted is None:
                continue
            if best is not None and not fitted.validation.error < best.validation.error:
                break
            best = fitted
            if best.validation.error**2 < (1.0 - CLEAR) * self.before.error**2:
                break
        return best

    def _fitted_from(self, label: str, start: Mapping[str, float]) -> ValidatedRefit | None:
        """The model with a spring; None where it cannot be calibrated.

        It is calibrated from the start values: the rotor of the rigid model moves the link, too.
        """
        try:
            elastic = self._elastic(label, start)
            return refit_and_validate(elastic, self.spans, label=label, holdout=self.holdout)
        except (JointscopeError, np.linalg.LinAlgError):
            return None

    def _rival(self, first: Candidate | None, torques: Mapping[str, Robot]) -> float:
        """Error on validation blocks of the first other candidate that is missing; infinite without one."""
        if first is None:
            return float("inf")
        if np.isfinite(first.validation_error):
            return first.validation_error
        try:
            grown = BaseModel.of(torques[first.label], self.base.recordings, self.base)
            return refit_and_validate(grown, self.spans, label=first.label).validation.error
        except (JointscopeError, np.linalg.LinAlgError):
            return float("inf")


def kept_by_predictions(candidate: Candidate, before: float, after: float) -> bool:
    """Whether a spring explains most of what predictions lack, how little torque it may take.

    Args:
        candidate: that was added.
        before: training error without it [sigma].
        after: the same with it.
    """
    return candidate.effect == SPRING and after**2 < (1.0 - CLEAR) * before**2


def _small_and_sure(spring: Candidate, told: Mapping[str, Candidate], before: ValidationError) -> Candidate:
    """A spring that is most of the torque that its joint lacks, little as that is, and that its calibration bears out.

    It bends the values of its neighbours' springs by far more than their sigmas; predictions, in which random torques
    add up, need only be no worse with it.
    """
    if spring.verdict == "missing" or not _is_most(told.get(spring.label)) or not spring.refitted:
        return spring
    compliance = spring.parameters["compliance"]
    if not compliance.value > SURE * compliance.sigma or not spring.validation_error < (1.0 + SAME) * before.error:
        return spring
    why = f"it is {100 * told[spring.label].share:.0f} % of the squared torque that its joint lacks, little as that is"
    return replace(spring, verdict="missing", reasons=(why, *spring.reasons[:1]))


def _is_most(told: Candidate | None) -> bool:
    """Whether missing torque says of a spring that it is there, small, and most of what its joint lacks."""
    return told is not None and told.share > CLEAR and any(reason.startswith(SMALL) for reason in told.reasons)


def _is_clear(spring: Candidate, told: Mapping[str, Candidate]) -> bool:
    return spring.share > CLEAR or _is_most(told.get(spring.label))


def _doubted(spring: Candidate, told: Mapping[str, Candidate]) -> Candidate:
    if spring.verdict != "missing" or _is_clear(spring, told):
        return spring
    why = f"but it explains less than {100 * CLEAR:.0f} % of the error"
    return replace(spring, verdict="possible", reasons=(*spring.reasons, why))
