# SPDX-License-Identifier: BSD-3-Clause
"""Which physical effect is missing: calibrate, score the catalogue, refit the leaders, decide on validation blocks."""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.base_model import BaseModel, Span
from jointscope.graphs.calibration.failures_with_notices import names_notices
from jointscope.graphs.comparison.compare import compare_model
from jointscope.graphs.comparison.comparison_result import ModelComparison
from jointscope.graphs.comparison.failure_analysis import analyse_failure
from jointscope.graphs.discovery.diagnosis_result import Candidate, Diagnosis
from jointscope.graphs.discovery.diagnosis_words import paragraphs_of
from jointscope.graphs.discovery.missing_torque import MissingTorque, estimate_missing_torque
from jointscope.graphs.discovery.scored_candidates import ScoredCandidates, score_candidates
from jointscope.graphs.discovery.side_by_side import SideBySide
from jointscope.graphs.discovery.spring_trials import SpringTrials
from jointscope.graphs.discovery.starting_model import starting_model, turns_over_sharper
from jointscope.graphs.discovery.torque_verdicts import TorqueVerdicts, torque_verdicts
from jointscope.graphs.discovery.unexplained import believed_floor, unexplained, unexplained_share
from jointscope.graphs.discovery.verdicts import (
    MATTERS,
    SENSOR_FLOOR,
    excess_share,
    judge,
    ranked,
    slowest_seen,
    standing_in,
    with_best_held_out,
    worth_a_refit,
)
from jointscope.graphs.refits.left_out import LeftOut, Missed
from jointscope.graphs.refits.validated_refit import ValidatedRefit, judged_seconds, refit_if_it_helps
from jointscope.graphs.refits.validation import ValidationError, fit_and_judge, judged_error
from jointscope.graphs.screening.screen_all import PLAIN_MISTAKES, screen_all
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.robots.errors import JointscopeError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

LEADERS = 3  # candidates that are refitted
PATIENCE = 2  # times as many, as long as none of them helps: one effect may hide that another one is right
MOST_REFITS = 4  # times as many at the most, those that ran away included
LONGEST = 12.0  # [s] of a recording in which the missing torque is estimated
ADEQUATE = 0.05  # share of the squared error that may stay unexplained
MUCH = 10.0  # [%] of the drive's torque that no adequate model leaves open, whatever it is
LOOK_FIRST = "Look at this before any effect"  # how a paragraph about a plain mistake begins
NEARLY_ALL, NEAR = 0.95, 0.5  # share of the excess after which only scores this near are looked at


@dataclass
class _Clock:
    """Wall seconds by stage."""

    seconds: dict[str, float] = field(default_factory=dict)
    _last: float = field(default_factory=time.perf_counter)

    def stage(self, name: str) -> None:
        now = time.perf_counter()
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self._last
        self._last = now


@in_solver_context
@names_notices
def diagnose(
    robot: Robot,
    recordings: Sequence[Recording],
    holdout: Recording | None = None,
    *,
    base: BaseModel | None = None,
    comparison: ModelComparison | None = None,
    validation: ValidationError | None = None,
    leaders: int = LEADERS,
    missing_torque: bool = True,
    side_by_side: SideBySide | None = None,
    barred: Collection[str] = (),
    each_held_out: bool = True,
    progress: Progress | None = None,
) -> Diagnosis:
    """Ranks the effects that a model lacks.

    Args:
        robot: the model.
        recordings: training recordings; they also give the validation blocks.
        holdout: scored once per refit and reported; it never chooses.
        base: the model calibrated with these recordings, if that was done.
        comparison: of that model with the held-out recording, else with the first training recording, if it was made.
        validation: errors of that model on the validation blocks, if they are known.
        leaders: number of candidates to refit; up to twice as many where none of them helps.
        missing_torque: estimate the missing torque, too; pictures need it, no verdict does.
        side_by_side: who fits the candidates, if not this process alone.
        barred: ID@OWNER of candidates that did not hold when calibrated; those after them by torque take their place.
        each_held_out: score the held-out recording with every refit, not with the best one alone.
        progress: called with a text and the share done, from 0 to 1.

    Raises:
        RecordingError: a recording cannot be a measurement of this robot.
        SolveError: the base model cannot be calibrated.
    """
    report, clock, pool = progress or (lambda text, share: None), _Clock(), side_by_side or SideBySide()
    pool.begin(leaders)
    report("calibrating the base model", 0.0)
    base = base or starting_model(robot, recordings, pool.solver)
    clock.stage("calibration")
    report("scoring the catalogue", 0.3)
    scored = score_candidates(base)
    clock.stage("score")
    report("where the model fails", 0.45)
    comparison = comparison or compare_model("base", base.robot, holdout or base.recordings[0])
    failure = analyse_failure(comparison, holdout or base.recordings[0])
    clock.stage("comparison")
    fit, spans = fit_and_judge(base)
    before = validation or judged_error(base, base.robot, base.calibrations, spans)
    trials = SpringTrials(base, (fit, spans), before, holdout)
    torques, elastic = _by_torques(base, scored, trials, barred)
    clock.stage("missing torque")
    percent: Mapping[str, float] = {}
    if torques is None:
        candidates, refits = _by_predictions(trials, scored, leaders, report, pool, each_held_out)
    else:
        candidates, refits, percent = torques.candidates, torques.refits, torques.percent
    clock.stage("refits")
    report("springs", 0.9)
    if not elastic:
        candidates, elastic = trials.beside(candidates, scored, refits, percent)
    refits = {**refits, **elastic}
    clock.stage("springs")
    best = next((c for c in candidates if c.verdict == "missing" and not c.numerics), None)
    share, floor = _unexplained(best, torques, elastic, comparison, holdout or base.recordings[0])
    missing = None
    if missing_torque:
        report("the missing torque", 0.95)
        missing = _missing_torque(base, {name: r for name, r in refits.items() if r.has_effect(*name.split("@"))})
        clock.stage("missing torque")
    result = Diagnosis(
        robot=base.robot,
        candidates=tuple(candidates),
        adequate=best is None
        and max(share, *_elsewhere(base, holdout, torques)) < ADEQUATE
        and max(percent.values(), default=0.0) < MUCH,
        unexplained_share=share,
        error=comparison.judged_error,
        floor=floor,
        validation_error=before.error,
        failure=failure,
        missing=missing,
        noise_levels=scored.noise_levels,
        placebo_score=scored.placebo,
        paragraphs=(),
        refits=refits,
        comparison=comparison,
        wall_seconds=clock.seconds,
        recordings=base.recordings,
        heldout=holdout,
        missing_torque=None if torques is None else torques.missing,
        missing_torque_percent=None if torques is None else torques.percent,
        small=() if torques is None else torques.small,
    )
    return replace(result, paragraphs=(*_first(base, robot, torques), *paragraphs_of(result)))


def _by_torques(
    base: BaseModel, scored: ScoredCandidates, trials: SpringTrials, barred: Collection[str]
) -> tuple[TorqueVerdicts | None, dict[str, Robot]]:
    """Verdicts by the missing torque, if it tells any, and the robot with the spring that comes first, if one does."""
    torques = torque_verdicts(base, scored, barred)
    spring, elastic = trials.borne_out(torques, scored)
    if torques is None or spring is None:
        return torques, {}
    if not elastic:
        return torque_verdicts(base, scored, (*barred, spring.label)), {}
    return replace(torques, candidates=[spring, *(c for c in torques.candidates if c.label != spring.label)]), elastic


def _unexplained(
    best: Candidate | None,
    torques: TorqueVerdicts | None,
    elastic: Mapping[str, Robot],
    comparison: ModelComparison,
    recording: Recording,
) -> tuple[float, float]:
    """Share of the squared error that stays with the best candidate, in the measure that judged it; and the floor."""
    floor = believed_floor(comparison, recording)
    if torques is not None and (best is None or best.label not in elastic):
        return torques.unexplained, floor
    after = comparison.judged_error
    if best is not None:
        after = best.heldout_error if np.isfinite(best.heldout_error) else best.validation_error
    return unexplained_share(after, floor), floor


def _to_look_at_first(base: BaseModel) -> list[str]:
    """Plain mistakes that the screening saw, and pushes: they look like effects, so they come first.

    The robot as it was before its calibration is screened: a mounting that was calibrated hides axes that are swapped.
    """
    notices = [notice for recording in base.recordings for notice in screen_all(recording, base.result.start)]
    texts = dict.fromkeys(notice.text for notice in notices if notice.kind in PLAIN_MISTAKES)
    texts |= dict.fromkeys(moment.sentence(bag.recording) for bag in base.result.bags for moment in bag.isolated)
    return [f"{LOOK_FIRST}: {text}." for text in texts]


def _first(base: BaseModel, given: Robot, torques: TorqueVerdicts | None) -> list[str]:
    """What is said before the verdict, also of a model that is not the one given, and of the torques that judge it."""
    texts = [turns_over_sharper(given, base.robot), "" if torques is None else torques.sentence]
    return [*_to_look_at_first(base), *(text for text in texts if text)]


def _missing_torque(base: BaseModel, refits: Mapping[str, Robot]) -> MissingTorque | None:
    """Of the beginning of the first training recording; None where its states cannot be estimated."""
    recording, ticks = base.recordings[0], base.problem_ticks(0)
    end = float(min(ticks[-1], ticks[0] + LONGEST))
    part = recording if end == ticks[-1] else recording.between(float(ticks[0]), end)
    kept = ticks <= end
    try:
        whole = bool(np.all(kept))
        states = base.states[0] if whole else None
        calibration = base.calibrations[0] if whole else None
        return estimate_missing_torque(base.robot, part, states, ticks if whole else None, calibration, refits)
    except JointscopeError:
        return None


def _elsewhere(base: BaseModel, holdout: Recording | None, torques: TorqueVerdicts | None) -> list[float]:
    """Unexplained shares of the further training recordings, where no recording was held out; at least one number."""
    others = base.recordings[1:] if holdout is None and torques is None else ()
    return [0.0, *(unexplained(compare_model("base", base.robot, recording), recording) for recording in others)]


def _by_predictions(
    trials: SpringTrials,
    scored: ScoredCandidates,
    leaders: int,
    report: Progress,
    side_by_side: SideBySide,
    each_held_out: bool,
) -> tuple[list[Candidate], Mapping[str, Robot]]:
    """Candidates judged by predictions after their refits, best first, and the robots refitted."""
    base, before, spans = trials.base, trials.before, trials.spans
    holdout, seconds = trials.holdout if each_held_out else None, judged_seconds(base, spans[1])
    tried = _refit_leaders(base, scored, before.error, spans, holdout, leaders, report, side_by_side)
    judged = [
        judge(c, before, tried.get(c.label), seconds, failed=tried.get(c.label, ()) is None) for c in scored.candidates
    ]
    slowest = slowest_seen(base.robot, base.recordings[0], base.states[0])
    judged = ranked([standing_in(c, slowest) for c in judged])
    refits = {name: found.refit.robot for name, found in tried.items() if isinstance(found, ValidatedRefit)}
    return judged if each_held_out else with_best_held_out(judged, refits, trials.holdout), refits


def _refit_leaders(
    base: BaseModel,
    scored: ScoredCandidates,
    error: float,
    spans: tuple[Sequence[Span], Sequence[Span]],
    holdout: Recording | None,
    leaders: int,
    report: Progress,
    side_by_side: SideBySide,
) -> dict[str, ValidatedRefit | Missed | None]:
    """Refits of the best candidates by label; None for those that ran away.

    Once one explains nearly all of the excess, only those whose score comes near its own are refitted, too; where none
    helps, the next ones are. One that ran away says nothing and takes no other's place.
    """
    worth = [c for c in scored.candidates if worth_a_refit(c, scored.placebo)][: MOST_REFITS * leaders]
    found, errors, enough = dict[str, ValidatedRefit | Missed | None](), list[float](), 0.0
    left_out = LeftOut.of(base, spans) if worth else None
    refits = side_by_side.in_order(refit_if_it_helps, (base, *spans, left_out, holdout), [c.best for c in worth])
    for candidate in worth:
        helped = any(after**2 < (1.0 - MATTERS) * error**2 for after in errors)
        tried = sum(each is not None for each in found.values())
        if candidate.plausible < enough or tried >= leaders * (1 if helped else PATIENCE):
            break
        report(f"refitting {candidate.label}", 0.5 + 0.5 * min(tried / leaders, 1.0))
        validated = found[candidate.label] = next(refits)
        if isinstance(validated, ValidatedRefit):
            errors.append(validated.validation.error)
            if excess_share(error, errors[-1], SENSOR_FLOOR) > NEARLY_ALL:
                enough = max(enough, NEAR * candidate.plausible)
    refits.close()
    return found
