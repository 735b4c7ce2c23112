# SPDX-License-Identifier: BSD-3-Clause
"""Verdicts where sensors are better than any model: candidates stand in the order of the missing torque they explain.

Predictions in sensor sigmas then measure how fine the sensor is. Joints that are rigid and seen by one encoder each are
judged so; others by their predictions.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from math import isfinite

from jointscope.graphs.calibration.base_model import BaseModel
from jointscope.graphs.discovery.diagnosis_result import Candidate, EffectEstimate
from jointscope.graphs.discovery.scored_candidates import ScoredCandidates
from jointscope.graphs.discovery.starting_model import torque_judge
from jointscope.graphs.judging.elastic_reaction import is_spring, spring_start
from jointscope.graphs.judging.torque_grids import hypotheses_on_motion
from jointscope.graphs.judging.torque_judge import NET, SHARE, TorqueJudge, TorqueJudgement
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.model.robot import Robot
from jointscope.robots.units import of_slide

UNHELD = "a calibration with it does not bear it out"
NUMERICS = "it is a choice of the computation, which torques averaged over many steps do not tell"
BEHIND = "torques averaged over many steps do not show it behind a spring whose link no sensor sees"
TIED = 0.01  # of a score: less says nothing
# a constant before friction that knows directions, which it is while a joint moves, and before a weight on a slide
SIMPLEST = (
    "motor_viscous",
    "torque_offset",
    "asymmetric_friction",
    "friction_by_direction",
    "gravity_imbalance",
    "parallel_spring",
)
MOST_SMALL = 4  # that are named
DRIVE_LATE, SEEN_LATE = ("command_delay", "motor_lag"), ("clock_offset", "encoder_delay")
EQUAL = 0.02  # difference of shares that decides nothing


@dataclass(frozen=True)
class TorqueVerdicts:
    """What the missing torque says.

    Attributes:
        candidates: best first.
        refits: robots with those that are missing, at their sizes.
        missing: root mean square torque on blocks left out by joint [N m].
        percent: the same in percent of the drive's.
        unexplained: share of its square that smooth laws would explain.
        sentence: all that in plain words.
        small: what is there, but not worth a parameter, with its torque; largest first.
    """

    candidates: list[Candidate]
    refits: dict[str, Robot]
    missing: Mapping[str, float]
    percent: Mapping[str, float]
    unexplained: float
    sentence: str
    small: tuple[str, ...] = ()


def torque_verdicts(base: BaseModel, scored: ScoredCandidates, barred: Collection[str] = ()) -> TorqueVerdicts | None:
    """Verdicts by the missing torque; None for a model that is judged by predictions.

    Args:
        base: the model.
        scored: the catalogue.
        barred: ID@OWNER of candidates that did not hold elsewhere.
    """
    judge = torque_judge(base)
    if judge is None:
        return None
    rigid = judge.equations.steps[0].segment.problem.robot  # without the springs of the model
    there = {here.label for here in base.robot.effects}
    hypotheses = [h for h in hypotheses_on_motion(rigid, judge.equations) if h.label not in there]
    judged = [judge.judge(list(own)) for _, own in groupby(hypotheses, key=lambda h: h.label)]
    found = {j.hypothesis.label: j for j in judged if j is not None}
    found |= {label: replace(found[label], refused=UNHELD) for label in barred if label in found}
    accepted = sorted((j for j in found.values() if not j.refused), key=lambda j: -j.common)
    equal = [j for j in accepted if j.common > accepted[0].common - EQUAL]
    fewest = min((j.dof for j in equal), default=0)
    first = [j for j in equal if j.dof == fewest]
    by_label = {c.label: c for c in _scored_only(scored, BEHIND if base.layout.motors else NUMERICS)}
    candidates = [_candidate(by_label.get(label), j, j in first, base.robot) for label, j in found.items()]
    alike = tuple(j.hypothesis.label for j in first)
    candidates = [
        replace(c, look_alikes=tuple(a for a in alike if a != c.label)[:3]) if c.label in alike else c
        for c in candidates
    ]
    candidates += [c for label, c in by_label.items() if label not in found]
    refits = {j.hypothesis.label: _with(base.robot, j) for j in first}
    names, drive = [rows.joint for rows in judge.rows], judge.drive
    missing = dict(zip(names, map(float, judge.missing), strict=True))
    percent = {name: 100.0 * missing[name] / float(d) for name, d in zip(names, drive, strict=True)}
    order = {"missing": 0, "stand_in": 1, "possible": 2, "absent": 3, "untestable": 4}
    shares = {label: j.common if j.net > NET else -1.0 for label, j in found.items()}
    scores = {label: j.score for label, j in found.items()}
    candidates.sort(key=lambda c: (order[c.verdict], -shares.get(c.label, -2.0), -scores.get(c.label, 0.0)))
    candidates = _simplest_first(candidates, scores)
    candidates.sort(key=lambda c: order[c.verdict])
    sentence = _sentence(base.robot, judge, missing, percent)
    small = _small(base.robot, judge, [j for j in found.values() if j.small and j.share > 0.0])
    return TorqueVerdicts(candidates, refits, missing, percent, judge.unexplained, sentence, small)


def _simplest_first(candidates: Sequence[Candidate], scores: Mapping[str, float]) -> list[Candidate]:
    """Missing ones in their order: between those that the motion does not tell apart no rounding decides.

    One encoder and one drive have one time between them, and a drive that acts late is what machines have; a clock or
    an encoder stands behind it, also where their columns, which hold what is missing, score a little higher.
    """
    missing = [c for c in candidates if c.verdict == "missing"]
    late = any(c.effect in DRIVE_LATE for c in missing)
    behind = {c.label for c in missing if late and c.effect in SEEN_LATE}
    best = max((scores[c.label] for c in missing if c.label not in behind), default=0.0)

    def place(c: Candidate) -> tuple[float, ...]:
        score = scores.get(c.label, 0.0)
        if c.verdict != "missing":
            return (0.0,)
        if c.label in behind or score < best - max(TIED * best, 1.0):
            return (1.0, -score)
        known = c.effect in SIMPLEST
        return (0.0, float(SIMPLEST.index(c.effect) if known else len(SIMPLEST)), -score)

    return sorted(candidates, key=place)


def _scored_only(scored: ScoredCandidates, reason: str) -> list[Candidate]:
    """Candidates as they are before anything is judged."""
    return [
        Candidate(
            effect=c.best.hypothesis.here.effect.id,
            owner=c.best.hypothesis.here.owner,
            score=c.plausible,
            dof=c.best.dof,
            p_value=c.p_value,
            parameters={},
            verdict="untestable",
            reasons=(reason,),
            look_alikes=c.look_alikes,
            numerics=c.best.hypothesis.here.effect.card.numerics,
        )
        for c in scored.candidates
    ]


def _candidate(scored: Candidate | None, j: TorqueJudgement, first: bool, robot: Robot) -> Candidate:
    here = j.hypothesis.here
    known = scored or Candidate(here.effect.id, here.owner, j.score, j.dof, float("nan"), {}, "absent")
    sizes = zip(j.hypothesis.sizes, j.sizes, j.sigmas, strict=True)
    units = {p.name: robot.unit_at(here.owner, p.unit) for p in j.hypothesis.sizes}
    parameters = {p.name: EffectEstimate(float(v), float(s), units[p.name]) for p, v, s in sizes if isfinite(s)}
    if is_spring(j.hypothesis):
        start = spring_start(robot, j.hypothesis)
        units = {p.name: robot.unit_at(here.owner, p.unit) for p in here.effect.parameters_at(robot, here.owner)}
        parameters = {name: EffectEstimate(v, float("nan"), units[name]) for name, v in start.items()}
    elif parameters:
        shapes = {p.name: p.unit for p in here.effect.parameters_at(robot, here.owner) if p.is_shape}
        for name, value in j.hypothesis.shapes.items():
            parameters[name] = EffectEstimate(
                float(value), float("nan"), robot.unit_at(here.owner, shapes.get(name, "1"))
            )
    helps = (
        f"it explains {100 * j.share:.0f} % of the squared missing torque on blocks left out, "
        f"and helps on {j.helped} of {j.blocks}"
    )
    reasons: tuple[str, ...]
    if first:
        verdict, reasons = "missing", (helps,)
    elif not j.refused:
        verdict, reasons = (
            "possible",
            (helps, "but another one explains more of it; look again once that is in the model"),
        )
    elif j.net <= NET:
        verdict, reasons = "absent", (j.refused,)
    else:
        stands_in = j.share > SHARE and not j.small
        verdict, reasons = ("stand_in", (helps, f"but {j.refused}")) if stands_in else ("possible", (j.refused,))
    return replace(
        known, score=j.score, dof=j.dof, parameters=parameters, verdict=verdict, reasons=reasons, share=j.share
    )


def _with(robot: Robot, j: TorqueJudgement) -> Robot:
    if is_spring(j.hypothesis):
        return add_effect(robot, j.hypothesis.label, dict(spring_start(robot, j.hypothesis)))
    start = {p.name: float(v) for p, v in zip(j.hypothesis.sizes, j.sizes, strict=True)}
    return add_effect(robot, j.hypothesis.label, start | {k: float(v) for k, v in j.hypothesis.shapes.items()})


def _small(robot: Robot, judge: TorqueJudge, found: Sequence[TorqueJudgement]) -> tuple[str, ...]:
    """What is small in words: torques where it acts on one joint, else parts of the drives."""
    texts, drive = [], {rows.joint: float(d) for rows, d in zip(judge.rows, judge.drive, strict=True)}
    for j in sorted(found, key=lambda j: -j.removed)[:MOST_SMALL]:
        owner, part = j.hypothesis.here.owner, f"{j.removed:.2g} % of the drive"
        if owner in drive:
            torque = f"{0.01 * j.removed * drive[owner]:.2g} of {drive[owner]:.3g} {_unit(robot, owner)}"
            texts.append(f"{j.hypothesis.label}, {torque}, {part}")
        else:
            texts.append(f"{j.hypothesis.label}, {part}")
    return tuple(texts)


def _unit(robot: Robot, joint: str) -> str:
    return of_slide("N m") if joint in robot.tree.slides else "N m"


def _sentence(robot: Robot, judge: TorqueJudge, missing: Mapping[str, float], percent: Mapping[str, float]) -> str:
    parts = []
    for noise, (joint, value) in zip(judge.noise, missing.items(), strict=True):
        unit = _unit(robot, joint)
        parts.append(
            f"{value:.3g} {unit} at {joint}, {percent[joint]:.1f} % of its drive, of which a random torque of "
            f"{noise.size:.2g} {unit} with {1e3 * noise.memory:.0f} ms of memory follows no law"
        )
    return "The missing torque on blocks left out is " + "; ".join(parts) + "."
