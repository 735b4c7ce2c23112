# SPDX-License-Identifier: BSD-3-Clause
"""Which effects are missing at rest, by what they are worth on groups of rests to which they were not fitted.

An effect helps if rests left out are likelier with it in most groups, none is harmed badly, and its sizes are possible.
With the best one in the model all are scored again: those that have nothing to say any more are look-alikes if they are
as good within noise, and stood in for it if not. Of equals the one with the fewest sizes leads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.rest_search.rest_fits import Mask, RestFit
from jointscope.graphs.rest_search.rest_hypotheses import tried_and_silent
from jointscope.graphs.rest_search.rest_race import ALIKE, Race, Tried, race, significant
from jointscope.graphs.rest_search.rest_scores import RestScore, RestScores, score_rests
from jointscope.robots.effect_kinds.effect import EffectParameter
from jointscope.robots.effect_kinds.joint_torque import is_spring_law

Array = NDArray[np.float64]
MOST = 0.6  # share of the groups that must be likelier
HARM = 0.2  # of what it gains in all, that it may lose in a group
MOST_OF_A_REST = 5.0  # log likelihood that one rest may gain or lose: edges of bands are sharp, and a miss is far out
ENOUGH = 3.0  # log likelihood of all groups together from which a gain is one, e^3 = 20 times likelier
TIED = 2.0  # [sigma over the groups] gains that differ by less are equal
DECISIVE = 5.0  # by which a log marginal likelihood must be larger to decide (Kass, Raftery 1995, JASA 90, sec. 3.2)
VERDICTS = ("missing", "possible", "stand_in", "absent", "untestable")


@dataclass(frozen=True)
class RestCandidate:
    """An effect that was looked at.

    Attributes:
        label: ID@OWNER.
        score: of the linear step.
        dof: sizes that the rests determine.
        p_value: of that score by chance.
        sizes: value, sigma and unit of each size, by the last part of its name; of the fit where there is one.
        gains: log likelihood that each group left out gains; None where it was not judged by them.
        look_alikes: labels of effects that do the same here.
        verdict: one of VERDICTS.
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
        """Log likelihood that all groups left out gain together; 0 where it was not judged by them."""
        return sum(self.gains or ())

    @property
    def helped(self) -> float:
        """Share of the groups that gain."""
        return float(np.mean(np.array(self.gains) > 0.0)) if self.gains else 0.0


@dataclass(frozen=True)
class Judged:
    """All candidates, best first, and the model with the one that leads, fitted to all rests; None without."""

    candidates: tuple[RestCandidate, ...]
    fit: RestFit | None

    @property
    def leading(self) -> RestCandidate | None:
        """The effect to add."""
        return None if self.fit is None else self.candidates[0]


def judge_rests(base: RestFit, folds: Sequence[Mask]) -> Judged:
    """Judges all effects that a fitted model lacks.

    Args:
        base: the model, fitted to all rests.
        folds: groups of rests that are left out in turn.
    """
    hypotheses, silent = tried_and_silent(base)
    scores = score_rests(base.rests, base.robot, base.x, hypotheses)
    count = sum(not score.silent for score in scores.scores)
    judge = _Judge(scores, count, race(base, scores, count, folds), folds)
    best = max(judge.good, key=lambda each: judge.gains(each).sum(), default=None)
    equal, after = judge.equal_to(best)
    leader = _simplest(equal)
    if leader is not best:
        _, after = judge.equal_to(leader)
    family = {each.label for each in equal}
    found = [judge.candidate(score, leader, family, after) for score in scores.scores]
    found += [RestCandidate(label, 0.0, 0, 1.0, {}, None, (), "untestable", why) for label, why in silent.items()]
    first = "" if leader is None else leader.label
    found.sort(key=lambda c: (c.label != first, VERDICTS.index(c.verdict), c.p_value, -c.score))
    return Judged(tuple(found), None if leader is None else leader.fit)


@dataclass(frozen=True)
class _Judge:
    """What is known of all effects: scores, how many count, those that were fitted, groups of rests."""

    scores: RestScores
    count: int
    race: Race
    folds: Sequence[Mask]
    good: list[Tried] = field(init=False)

    def __post_init__(self) -> None:
        judged = [each for each in self.race.tried.values() if each.costs is not None]
        object.__setattr__(self, "good", [each for each in judged if self._is_good(each)])

    def gains(self, tried: Tried) -> Array:
        """Log likelihood that each group gains by an effect, shape (folds,)."""
        return self._gained(self.race.without, tried.costs)

    def equal_to(self, best: Tried | None) -> tuple[list[Tried], RestScores | None]:
        """Good effects that are worth as much as the best one, and nothing beside it; scores beside it."""
        if best is None:
            return [], None
        hypotheses, _ = tried_and_silent(best.fit)
        after = score_rests(best.fit.rests, best.fit.robot, best.fit.x, hypotheses)
        others = [each for each in self.good if each is not best and self._equal(best, each)]
        return [best, *(each for each in others if not self._remains(each.score, after))], after

    def candidate(
        self, score: RestScore, leader: Tried | None, family: set[str], after: RestScores | None
    ) -> RestCandidate:
        """What a score comes to beside the leading effect with its family of equals."""
        tried = self.race.tried.get(score.label)
        gains = None if tried is None or tried.costs is None else tuple(self.gains(tried).tolist())
        return RestCandidate(
            score.label, score.fall, score.dof, score.p_value, _sizes(score, tried), gains,
            self._look_alikes(score, family), self._verdict(score, leader, family, after), score.silent,
        )  # fmt: skip

    def _verdict(self, score: RestScore, leader: Tried | None, family: set[str], after: RestScores | None) -> str:
        if score.silent:
            return "untestable"
        if leader is not None and score.label == leader.label:
            return "missing"
        tried = self.race.tried.get(score.label)
        worthless = tried is not None and tried.costs is not None and self.gains(tried).sum() <= 0.0
        if worthless or not significant(score, self.count):
            return "absent"
        if leader is None or after is None or score.label in family:
            return "possible"
        if not self._remains(score, after):
            return "stand_in"
        if score.label not in {each.label for each in self.good}:
            return "possible"
        return "stand_in" if self._is_better_alike(score) else "missing"

    def _is_better_alike(self, score: RestScore) -> bool:
        """Whether a good effect that explains the same to first order is worth more."""
        own = self.gains(self.race.tried[score.label]).sum()
        others = [each for each in self.good if each.label != score.label and self.gains(each).sum() > own]
        return any(self.scores.alike(each.score, score) > ALIKE for each in others)

    def _look_alikes(self, score: RestScore, family: set[str]) -> tuple[str, ...]:
        """Equals of the leading effect's family; effects that explain the same to first order and were not fitted."""
        if not significant(score, self.count):
            return ()
        names = sorted(family - {score.label}) if score.label in family else []
        for other in self.scores.scores:
            if other.label != score.label and other.label not in self.race.tried and significant(other, self.count):
                names += [other.label] if self.scores.alike(score, other) > ALIKE else []
        return tuple(names)

    def _remains(self, score: RestScore, after: RestScores) -> bool:
        """Whether an effect has something to say beside another one."""
        beside = after.of(score.label)
        return beside is not None and significant(beside, self.count)

    def _is_good(self, tried: Tried) -> bool:
        """Whether an effect helps what was left out, harms no group, and has possible sizes."""
        gains, total = self.gains(tried), float(self.gains(tried).sum())
        helps = total > ENOUGH and np.mean(gains > 0.0) >= MOST and gains.min() > -max(HARM * total, 1.0)
        return bool(helps) and _possible(tried)

    def _equal(self, best: Tried, other: Tried) -> bool:
        lost = self._gained(other.costs, best.costs)
        return bool(lost.sum() <= max(ENOUGH, TIED * float(np.std(lost)) * np.sqrt(len(lost))))

    def _gained(self, before: Array | None, after: Array | None) -> Array:
        assert before is not None and after is not None
        gained = np.clip(before - after, -MOST_OF_A_REST, MOST_OF_A_REST)
        return np.array([gained[fold].sum() for fold in self.folds])


def _simplest(equal: Sequence[Tried]) -> Tried | None:
    """Of effects that are worth as much on what was left out the one with the fewest sizes.

    Among laws of one spring, a polynomial and a curve of pieces, evidence may say that it is too simple.
    """
    simplest = min(equal, key=lambda each: each.score.dof, default=None)
    if simplest is None or not _bends_spring(simplest):
        return simplest
    laws = [each for each in equal if each.owner == simplest.owner and _bends_spring(each)]
    best = max(laws, key=lambda each: each.evidence)
    return best if best.evidence > simplest.evidence + DECISIVE else simplest


def _bends_spring(tried: Tried) -> bool:
    return is_spring_law(tried.score.score.hypothesis.here.effect)


def _possible(tried: Tried) -> bool:
    """Whether all sizes are plausible, and have a sign that may be."""
    found = tried.sizes
    for size in tried.score.score.hypothesis.sizes:
        beyond = found[size.name] - size.null
        if abs(beyond) > _largest(size) or (size.sign == "+" and beyond < 0.0):
            return False
    return True


def _largest(size: EffectParameter) -> float:
    """The largest size that its prior leaves plausible; a logarithm's may be off by two of its own sigmas."""
    if not size.logarithmic:
        return size.prior_sigma
    return float(size.start * np.exp(2.0 * size.prior_sigma / size.start))


def _sizes(score: RestScore, tried: Tried | None) -> dict[str, tuple[float, float, str]]:
    columns = zip(score.score.hypothesis.sizes, score.score.estimate, score.score.sigma, strict=True)
    linear = {size.name: (float(value), float(sigma), size.unit) for size, value, sigma in columns}
    if tried is None:
        return linear
    return {name: (tried.sizes[name], tried.sigmas[name], unit) for name, (_, _, unit) in linear.items()}
