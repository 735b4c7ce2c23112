# SPDX-License-Identifier: BSD-3-Clause
"""From scores and refits to verdicts: missing, possible, absent, untestable, each with its reasons.

Scores rank, validation decides. An effect is missing if its refit lowers the error on validation blocks by a share that
matters, on most of the blocks, with a possible sign, and pays for its parameters. A recording that was held out never
enters here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.discovery.diagnosis_result import Candidate, EffectEstimate
from jointscope.graphs.discovery.scored_candidates import SIGNIFICANT, ScoredCandidate
from jointscope.graphs.refits.left_out import Missed
from jointscope.graphs.refits.validated_refit import ValidatedRefit
from jointscope.graphs.refits.validation import ValidationError, reported_heldout_error
from jointscope.robots.effect_kinds.effect import Effect, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointTorque
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

MATTERS = 0.02  # share of the squared validation error that an effect must explain
MOST = 0.6  # share of the validation blocks on which it must help
SURE = 3.0  # [sigma] a refitted size must be away from null
HORIZON = 0.1  # [s] predictions of this length that do not overlap count as independent
SENSOR_FLOOR = 1.0  # [sigma] no prediction is better than its sensor
HARM = 3.0  # times the error on a block from which an effect is said to harm there
STRIBECK = "motor_stribeck"
PASSED = 0.1  # part of a sample period in which a joint passes speeds that samples cannot see
SAME = 0.02  # relative difference of errors that decides nothing


def judge(
    scored: ScoredCandidate,
    base: ValidationError,
    validated: ValidatedRefit | Missed | None,
    seconds: float,
    failed: bool = False,
) -> Candidate:
    """The verdict on one candidate.

    Args:
        scored: its score.
        base: errors of the base model on validation blocks.
        validated: its refit, or that it was given up; None if it was not worth one.
        seconds: of all validation blocks.
        failed: whether its refit ran away.
    """
    here, sizes = scored.best.hypothesis.here, scored.best.hypothesis.sizes
    if not isinstance(validated, ValidatedRefit):
        parameters = {
            size.name: EffectEstimate(float(value), float(sigma), size.unit)
            for size, value, sigma in zip(sizes, scored.best.estimate, scored.best.sigma, strict=True)
        }
        verdict, reasons = _without_refit(scored, failed) if validated is None else _after_giving_up(validated)
        return _candidate(scored, parameters, verdict, reasons)
    robot, refit = validated.refit.robot, validated.refit
    parameters = {
        p.name: EffectEstimate(robot.parameters[here.parameter(p.name)].value, refit.sigmas.get(p.name, np.nan), p.unit)
        for p in here.effect.parameters_at(robot, here.owner)
    }
    share = excess_share(base.error, validated.validation.error, SENSOR_FLOOR)
    bic = _bic(base.error, validated.validation.error, len(parameters), seconds)
    verdict, reasons = _after_refit(scored, base, validated, parameters, bic, sizes)
    return replace(
        _candidate(scored, parameters, verdict, reasons),
        share=share,
        refitted=True,
        validation_error=validated.validation.error,
        heldout_error=validated.heldout,
        bic=bic,
    )


def _candidate(
    scored: ScoredCandidate, parameters: Mapping[str, EffectEstimate], verdict: str, reasons: tuple[str, ...]
) -> Candidate:
    here = scored.best.hypothesis.here
    return Candidate(
        effect=here.effect.id,
        owner=here.owner,
        score=scored.plausible,
        dof=scored.best.dof,
        p_value=scored.p_value,
        parameters=parameters,
        verdict=verdict,
        look_alikes=scored.look_alikes,
        reasons=reasons,
        numerics=here.effect.card.numerics,
    )


def excess_share(before: float, after: float, floor: float) -> float:
    """Part of the squared error above the floor that went, at most 1."""
    excess = before**2 - min(floor, before) ** 2
    return float(min((before**2 - after**2) / excess, 1.0)) if excess > 0 else 0.0


def worth_a_refit(scored: ScoredCandidate, placebo: float) -> bool:
    """Whether a score is beyond chance and beyond what meaningless regressors reach."""
    return scored.chance < SIGNIFICANT and scored.plausible / scored.best.dof > placebo


def _without_refit(scored: ScoredCandidate, failed: bool) -> tuple[str, tuple[str, ...]]:
    if failed:
        return "possible", ("its refit ran away; calibrate a robot with it to see",)
    if scored.right_sign and scored.chance < SIGNIFICANT:
        return "possible", ("its score is beyond chance, but others explain more; it was not refitted",)
    effect, sizes = scored.best.hypothesis.here.effect, scored.best.hypothesis.sizes
    reach = {size.name: SURE * float(sigma) for size, sigma in zip(sizes, scored.best.sigma, strict=True)}
    if sizes and all(reach[size.name] > _worth_seeing(effect, size) for size in sizes):
        size = sizes[0]
        return "untestable", (
            f"this motion cannot show it: {size.name} of {_worth_seeing(effect, size):g} {size.unit} would stay within "
            f"{SURE:g} sigma; needed: {effect.card.excitation}",
        )
    if not scored.right_sign:
        return "absent", ("the data want the impossible sign",)
    return "absent", ("it would explain no more than chance",)


def _after_giving_up(missed: Missed) -> tuple[str, tuple[str, ...]]:
    """Of a candidate that makes what its fit leaves out far less likely."""
    reason = (
        f"fitted to pieces of the recordings, it misses those between {missed.times:.2g} times as far as without it"
    )
    if missed.converged:
        return "absent", (reason,)
    return "possible", (f"{reason}; its refit did not converge: calibrate a robot with it to see",)


def _worth_seeing(effect: Effect, size: EffectParameter) -> float:
    """A size that a diagnosis should be able to see: the catalogue's example, else the largest plausible one."""
    example = abs(effect.example.get(size.name, 0.0))
    return example if example > 0.0 else size.prior_sigma / 10.0


def _after_refit(
    scored: ScoredCandidate,
    base: ValidationError,
    validated: ValidatedRefit,
    parameters: Mapping[str, EffectEstimate],
    bic: float,
    sizes: tuple[EffectParameter, ...],
) -> tuple[str, tuple[str, ...]]:
    now, reasons = validated.validation, []
    fall = 1.0 - (now.error / base.error) ** 2
    if not validated.refit.converged and not fall >= MATTERS:
        return "possible", ("its refit did not converge; calibrate a robot with it to see",)
    if not np.isfinite(now.error) or fall < MATTERS:
        return "absent", (
            f"with it the error on validation blocks goes from {base.error:.3g} to {now.error:.3g} sigma",
        )
    reasons.append(f"the error on validation blocks falls from {base.error:.3g} to {now.error:.3g} sigma")
    seen = np.isfinite(now.by_span) & np.isfinite(base.by_span)
    better = int(np.sum(now.by_span[seen] < base.by_span[seen]))
    reasons.append(f"it helps on {better} of {int(seen.sum())} validation blocks")
    worse = now.by_span[seen] / np.maximum(base.by_span[seen], SENSOR_FLOOR)
    if np.max(worse, initial=0.0) > HARM:
        reasons.append(
            f"on one of them it makes the error {np.max(worse):.1f} times larger: it may stand in for something else"
        )
    sizes = tuple(s for s in sizes if s.name in parameters)
    wrong = [s.name for s in sizes if s.sign == "+" and parameters[s.name].value < s.null]
    if wrong:
        return "absent", (*reasons, f"but {wrong[0]} comes out with the impossible sign")
    unsure = bool(sizes) and all(
        abs(parameters[s.name].value - s.null) < SURE * parameters[s.name].sigma for s in sizes
    )
    if unsure:
        return "possible", (*reasons, f"but no size is {SURE:g} sigma away from null")
    if better < MOST * seen.sum() or bic >= 0.0:
        return "possible", (*reasons, "but not on enough of them, or not enough for its parameters")
    return "missing", tuple(reasons)


def _bic(before: float, after: float, parameters: int, seconds: float) -> float:
    """Change of the Bayesian information criterion; predictions that do not overlap are the samples."""
    if not np.isfinite(after):
        return float("nan")
    samples = max(seconds / HORIZON, 2.0)
    return float(samples * np.log(after**2 / before**2) + parameters * np.log(samples))


def slowest_seen(robot: Robot, recording: Recording, states: NDArray[np.float64]) -> dict[str, float]:
    """Speed of each joint below which samples see nothing of a curve of friction [rad/s].

    It is passed within a part of a sample period at the usual acceleration, or lost in the noise of two positions.

    Args:
        robot: the model.
        recording: of it.
        states: estimated, shape (k, d), in the order of time.
    """
    encoder, layout = robot.motor_encoder, robot.layout
    stream = recording.streams[encoder.name]
    v = states[:, layout.velocities]
    step = float(np.ptp(stream.times)) / max(len(states) - 1, 1)
    found = {}
    for joint, period, sigma in zip(robot.joints, stream.periods, encoder.sigmas, strict=True):
        rush = float(np.sqrt(np.mean((np.diff(v[:, layout.links.index(joint)]) / step) ** 2)))
        found[joint] = max(PASSED * rush * float(period), float(np.sqrt(2.0) * sigma / period))
    return found


def standing_in(candidate: Candidate, slowest: Mapping[str, float]) -> Candidate:
    """A candidate that is a curve of friction at speeds of which nothing is seen: there, joints stick or creep.

    Args:
        candidate: judged.
        slowest: of `slowest_seen`.
    """
    velocity, seen = candidate.parameters.get("velocity"), slowest.get(candidate.owner.removesuffix(".link"), 0.0)
    if candidate.effect != STRIBECK or candidate.verdict != "missing" or velocity is None or velocity.value >= seen:
        return candidate
    reason = (
        f"but only below {velocity.value:.2g} {velocity.unit}, where samples see nothing (from {seen:.2g} on they do): "
        "dry friction that holds the joint until it breaks away does the same; its size is not to be believed"
    )
    return replace(candidate, verdict="stand_in", reasons=(*candidate.reasons, reason))


def ranked(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Missing ones first, by validation error; where that is the same, by what they cost and by score.

    Laws that do the same, as viscous friction of motor and link do at a rigid joint, have the same score but for
    rounding: then the drive's comes first.
    """
    order = {"missing": 0, "stand_in": 1, "possible": 2, "absent": 3, "untestable": 4}
    missing = [c for c in candidates if c.verdict == "missing"]
    best = min(missing, key=lambda c: c.validation_error, default=None)
    if best is not None:
        smallest = best.validation_error * (1.0 + SAME)
        candidates = [c if c.validation_error <= smallest else yielding(c, best) for c in candidates]

    links = {e.id for e in catalogue().values() if isinstance(e, JointTorque) and e.side == "link"}

    def key(c: Candidate) -> tuple[float, ...]:
        of_link = float(c.effect in links)
        score = float(f"{c.score:.6g}")
        if c.verdict == "missing":
            return (0.0, float(c.dof), -score, of_link)
        return (float(order[c.verdict]), -score, of_link)

    return sorted(candidates, key=key)


def yielding(candidate: Candidate, best: Candidate) -> Candidate:
    """A candidate that explains only part of what the best one explains: no more than possible."""
    if candidate.verdict != "missing":
        return candidate
    reason = f"but {best.label} explains more of it; look again once that is in the model"
    return replace(candidate, verdict="possible", reasons=(*candidate.reasons, reason))


def with_best_held_out(
    candidates: Sequence[Candidate], refits: Mapping[str, Robot], holdout: Recording | None
) -> list[Candidate]:
    """The candidates, the best missing one with its error on the held-out recording."""
    best = next((c for c in candidates if c.verdict == "missing"), None)
    if best is None:
        return list(candidates)
    held_out = replace(best, heldout_error=reported_heldout_error(refits[best.label], holdout))
    return [held_out if c is best else c for c in candidates]
