# SPDX-License-Identifier: BSD-3-Clause
"""What effects are worth on groups of rests to which they were not fitted, and which of them is missing.

The most significant effects are fitted for real, to all groups but one in turn, and compared with the model without
them on the group left out. One is missing if that is likelier with it in most groups, if it harms none badly, and if its
sizes are possible. Of effects that are equally good within noise the simplest leads, the others are look-alikes. With
the leading one in the model all are scored again: those that have nothing to say any more only stood in for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.rest_search.rest_fits import Mask, RestFit, fit_rests
from jointscope.graphs.rest_search.rest_hypotheses import tried_and_silent
from jointscope.graphs.rest_search.rest_scores import RestScore, RestScores, score_rests
from jointscope.graphs.rests.calibrate_rests import EDGES
from jointscope.robots.errors import SolveError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
CHANCE = 0.01  # of any false effect among all that are looked at
LOOKED_AT = 8  # effects that are fitted for real
OF_A_KIND = 3  # of these, that explain the same to first order
ALIKE = 0.95  # correlation of what two effects explain
MOST = 0.6  # share of the groups that must be likelier
HARM = 0.2  # of what it gains in all, that it may lose in a group
MOST_OF_A_REST = 5.0  # log likelihood that one rest may gain or lose: edges of bands are sharp, and a miss is far out
ENOUGH = 3.0  # log likelihood of all groups together from which a gain is one, e^3 = 20 times likelier
TIED = 2.0  # [sigma over the groups] gains that differ by less are equal
SMALLEST_START = 0.05  # of the start value, where a size that is estimated as a logarithm begins at least


@dataclass(frozen=True)
class RestCandidate:
    """An effect that was looked at.

    Attributes:
        label: ID@OWNER.
        score: of the linear step.
        dof: sizes that the rests determine.
        p_value: of that score by chance.
        sizes: value, sigma and unit of each size, by the last part of its name; of the fit where there is one.
        gains: log likelihood that each group left out gains; None where it was not fitted.
        look_alikes: labels of effects that do the same here.
        verdict: missing, possible, absent, stand_in or untestable.
        why: why it is untestable.
    """

    label: str
    score: float
    dof: int
    p_value: float
    sizes: Mapping[str, tuple[float, float, str]]
    gains: tuple[float, ...] | None
    look_alikes: tuple[str, ...]
    verdict: str
    why: str = ""

    @property
    def gain(self) -> float:
        """Log likelihood that all groups left out gain together; 0 where it was not fitted."""
        return sum(self.gains or ())

    @property
    def helped(self) -> float:
        """Share of the groups that gain."""
        return float(np.mean(np.array(self.gains) > 0.0)) if self.gains else 0.0


@dataclass(frozen=True)
class Judged:
    """All candidates, best first, and the model with the one that leads, fitted to all rests; None without."""

    candidates: tuple[RestCandidate, ...]
    leading: str
    fit: RestFit | None


@dataclass(frozen=True)
class _Tried:
    """An effect that was fitted."""

    score: RestScore
    fit: RestFit
    gains: Array

    @property
    def gain(self) -> float:
        return float(self.gains.sum())


def judge_rests(base: RestFit, folds: Sequence[Mask]) -> Judged:
    """Judges all effects that a fitted model lacks.

    Args:
        base: the model, fitted to all rests.
        folds: groups of rests that are left out in turn.
    """
    robot = base.robot
    hypotheses, silent = tried_and_silent(robot)
    scores = score_rests(base.rests, robot, base.x, hypotheses)
    count = sum(not score.silent for score in scores.scores)
    chosen = _chosen(scores, count)
    without = _left_out(base, folds) if chosen else np.zeros(0)
    tried = {}
    for score in chosen:
        found = _tried(base, score, folds, without)
        if found is not None:
            tried[score.label] = found
    good = [each for each in tried.values() if _is_good(each)]
    best, tied = _leader(good)
    after = None
    if best is not None:
        again, _ = tried_and_silent(best.fit.robot)
        after = score_rests(best.fit.rests, best.fit.robot, best.fit.x, again)
    verdicts = _Verdicts(count, tried, {each.score.label for each in good}, best, {t.score.label for t in tied}, after)
    candidates = [verdicts.of(score, scores) for score in scores.scores]
    candidates += [RestCandidate(label, 0.0, 0, 1.0, {}, None, (), "untestable", why) for label, why in silent.items()]
    leading = "" if best is None else best.score.label
    return Judged(tuple(sorted(candidates, key=lambda c: _rank(c, leading))), leading, None if best is None else best.fit)


@dataclass(frozen=True)
class _Verdicts:
    """What each score comes to; `tied` are labels as good as the best one, `after` scores beside it."""

    count: int
    tried: Mapping[str, _Tried]
    good: set[str]
    best: _Tried | None
    tied: set[str]
    after: RestScores | None

    def of(self, score: RestScore, scores: RestScores) -> RestCandidate:
        tried = self.tried.get(score.label)
        gains = None if tried is None else tuple(tried.gains.tolist())
        sizes = _sizes(score) if tried is None else _fitted(tried)
        alike = self._look_alikes(score, scores)
        found = RestCandidate(
            score.label, score.score.plausible[0], score.dof, score.p_value, sizes, gains, alike,
            self._verdict(score), score.silent,
        )  # fmt: skip
        return found

    def _verdict(self, score: RestScore) -> str:
        label = score.label
        if score.silent:
            return "untestable"
        if self.best is not None and label == self.best.score.label:
            return "missing"
        if score.p_value * self.count >= CHANCE:
            return "absent"
        if self.best is None:
            return "possible"
        beside = self.after.of(label) if self.after is not None else None
        remains = beside is not None and not beside.silent and beside.p_value * self.count < CHANCE
        if label in self.tied:
            return "possible"
        if not remains:
            return "stand_in"
        return "missing" if label in self.good else "possible"

    def _look_alikes(self, score: RestScore, scores: RestScores) -> tuple[str, ...]:
        if score.silent or score.p_value * self.count >= CHANCE:
            return ()
        names = []
        if self.best is not None and score.label in self.tied | {self.best.score.label}:
            names += [label for label in (self.best.score.label, *sorted(self.tied)) if label != score.label]
        for other in scores.scores:
            if other.silent or other.label in (score.label, *names) or other.p_value * self.count >= CHANCE:
                continue
            if scores.alike(score, other) > ALIKE and other.label not in self.tried:
                names.append(other.label)
        return tuple(dict.fromkeys(names))


def _rank(candidate: RestCandidate, leading: str) -> tuple[int, float, float]:
    order = ("missing", "possible", "stand_in", "absent", "untestable")
    place = -1 if candidate.label == leading else order.index(candidate.verdict)
    return place, candidate.p_value, -candidate.score


def _chosen(scores: RestScores, count: int) -> list[RestScore]:
    """The most significant effects, few of those that explain the same."""
    found: list[RestScore] = []
    for score in scores.scores:
        if score.silent or score.p_value * count >= CHANCE:
            continue
        if sum(scores.alike(score, other) > ALIKE for other in found) < OF_A_KIND and len(found) < LOOKED_AT:
            found.append(score)
    return found


def _tried(base: RestFit, score: RestScore, folds: Sequence[Mask], without: Array) -> _Tried | None:
    """An effect fitted to all rests, and to all groups but one in turn; None where it ran away."""
    robot = with_score(base.robot, score)
    try:
        start = Calibration.of(robot).only(base.calibration.blocks)
        fit = fit_rests(base.rests.of_robot(robot), base.x, start, EDGES)
        gained = np.clip(without - _left_out(fit, folds), -MOST_OF_A_REST, MOST_OF_A_REST)
        return _Tried(score, fit, np.array([gained[fold].sum() for fold in folds]))
    except SolveError:
        return None


def with_score(robot: Robot, score: RestScore) -> Robot:
    """The robot with an effect at the sizes that a linear step gives; those that do nothing at rest are held."""
    hypothesis, start = score.score.hypothesis, dict(score.score.hypothesis.shapes)
    for size, value in zip(hypothesis.sizes, score.score.estimate.tolist(), strict=True):
        value = float(np.clip(value, -size.prior_sigma, size.prior_sigma))
        start[size.name] = max(value, SMALLEST_START * size.start) if size.logarithmic else value
    robot = add_effect(robot, score.label, start)
    held = {hypothesis.here.parameter(name) for name in score.held}
    parameters = {
        n: replace(p, fixed=True, value=p.prior if p.null is None else p.null) if n in held else p
        for n, p in robot.parameters.items()
    }
    return replace(robot, parameters=parameters)


def _left_out(fit: RestFit, folds: Sequence[Mask]) -> Array:
    """Cost of each rest, fitted to the groups that it is not in, shape (m,)."""
    found = np.zeros(len(fit.x))
    for fold in folds:
        found[fold] = fit.without(fold).costs_of(fit.rests.only(fold), fit.x[fold])
    return found


def _is_good(tried: _Tried) -> bool:
    """Whether an effect helps what was left out, harms no group, and has possible sizes."""
    gains, total = tried.gains, tried.gain
    helps = total > ENOUGH and np.mean(gains > 0.0) >= MOST and gains.min() > -max(HARM * total, 1.0)
    return bool(helps) and _possible(tried)


def _possible(tried: _Tried) -> bool:
    hypothesis, values = tried.score.score.hypothesis, tried.fit.values
    for size in hypothesis.sizes:
        value = values.get(hypothesis.here.parameter(size.name), size.null) - size.null
        if abs(value) > size.prior_sigma or (size.sign == "+" and value < 0.0):
            return False
    return True


def _leader(good: Sequence[_Tried]) -> tuple[_Tried | None, list[_Tried]]:
    """The best effect, and others that are as good within noise; the one with the fewest sizes leads."""
    if not good:
        return None, []
    best = max(good, key=lambda each: each.gain)
    equal = [each for each in good if _equal(best.gains, each.gains)]
    leader = min(equal, key=lambda each: (each.score.dof, -each.gain))
    return leader, [each for each in equal if each is not leader]


def _equal(best: Array, other: Array) -> bool:
    lost = best - other
    return bool(lost.sum() <= max(ENOUGH, TIED * float(np.std(lost)) * np.sqrt(len(lost))))


def _sizes(score: RestScore) -> dict[str, tuple[float, float, str]]:
    columns = zip(score.score.hypothesis.sizes, score.score.estimate, score.score.sigma, strict=True)
    return {size.name: (float(value), float(sigma), size.unit) for size, value, sigma in columns}


def _fitted(tried: _Tried) -> dict[str, tuple[float, float, str]]:
    hypothesis, values = tried.score.score.hypothesis, tried.fit.values
    found = _sizes(tried.score)
    return {
        name: (values.get(hypothesis.here.parameter(name), value), sigma, unit)
        for name, (value, sigma, unit) in found.items()
    }
