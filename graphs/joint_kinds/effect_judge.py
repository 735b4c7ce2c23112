# SPDX-License-Identifier: BSD-3-Clause
"""What effects that a model lacks are worth in each kind of recordings, on folds to which they were not fitted.

Every effect is fitted, linearly, to all recordings but one fold of one kind in turn, and judged on that fold, with one
noise for all, that of the present model. It is missing where it is significant among so many, helps most folds of a
kind, harms no other kind, and has possible sizes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc
from scipy.stats import chi2

from jointscope.graphs.joint_kinds.linear_kinds import LinearKind, LinearKinds
from jointscope.graphs.poses.calibrate_poses import TOUCHED
from jointscope.robots.geometry.arm_effects import ArmHypothesis

Array = NDArray[np.float64]
CHANCE = 0.01  # of any false effect among all that are looked at
HINT = 0.01  # chance at which an effect is worth more recordings
MOST = 0.6  # share of the folds that must be met better
GAIN = 0.02  # of the squared distances of what was left out


@dataclass(frozen=True)
class Gain:
    """What an effect is worth in a kind of recordings.

    Attributes:
        share: of the squared distances of left-out recordings that it takes away.
        helped: share of the folds that it helps.
    """

    share: float
    helped: float

    @property
    def shows(self) -> bool:
        """Whether this kind shows the effect."""
        return self.share > GAIN and self.helped >= MOST


@dataclass(frozen=True)
class ArmCandidate:
    """An effect that was looked at.

    Attributes:
        hypothesis: effect and owner.
        score: fall of chi2 on all recordings.
        p_value: of that fall by chance, of the best one of as many orders or stiffnesses as were looked at.
        gains: what it is worth, by the kinds in which it does anything.
        evidence: twice the logarithm of how much likelier left-out recordings become, the best of some looks as one.
        sizes, sigmas: of its parameters; of stiffnesses their compliances.
        look_alikes: labels of effects that would do the same here.
        verdict: missing, possible, absent or untestable.
        alone: by kind, effects that would do the same in this kind alone.
        looks: number of orders or stiffnesses of which it is the best one.
        wanted: fall of chi2 from which on it would be significant among all effects.
        explained_by: label of the likeliest missing effect, where with that in the model this one is not missing any
            more; "" for that one, and for what it leaves.
    """

    hypothesis: ArmHypothesis
    score: float
    p_value: float
    gains: Mapping[str, Gain]
    evidence: float
    sizes: tuple[float, ...]
    sigmas: tuple[float, ...]
    look_alikes: tuple[str, ...]
    verdict: str
    alone: Mapping[str, tuple[str, ...]]
    looks: int
    wanted: float
    explained_by: str = ""

    @property
    def beside_the_best(self) -> ArmCandidate:
        """The same, as a model with the likeliest missing effect sees it: possible where that explains it."""
        return replace(self, verdict="possible") if self.explained_by and self.verdict == "missing" else self

    @property
    def smallest(self) -> float:
        """Size of the parameter that is told least well below which the effect would not be significant."""
        return max(self.sigmas) * float(np.sqrt(self.wanted))

    @property
    def times(self) -> float:
        """How many times as many recordings would make it significant, half the time, if it is what it looks like.

        Chi2 falls in proportion to their number, but for what chance adds to the best of some looks. Infinite where
        what was left out speaks against it, or where chance says as much of one of a hundred effects.
        """
        by_chance = len(self.sizes) + 2.0 * float(np.log(self.looks))
        hinted = self.p_value < HINT and _shown(self.gains) and self.score > by_chance
        return max((self.wanted - by_chance) / (self.score - by_chance), 1.0) if hinted else np.inf

    @property
    def gain(self) -> float:
        """Of the kind to which it is worth most."""
        return max(gain.share for gain in self.gains.values())

    @property
    def helped(self) -> float:
        """Of the folds of that kind."""
        return max(self.gains.values(), key=lambda gain: gain.share).helped

    @property
    def shown_by(self) -> tuple[str, ...]:
        """Kinds that show it."""
        return tuple(kind for kind, gain in self.gains.items() if gain.shows)


Looked = tuple[ArmHypothesis, Mapping[str, Array], int]
"""An effect, its whitened columns by kind, and the number of orders or stiffnesses of which it is the best one."""


class EffectJudge:
    """Judges effects one by one.

    Args:
        linear: the recordings.
        count: number of effects that are looked at.
    """

    def __init__(self, linear: LinearKinds, count: int):
        self._linear, self._count = linear, count
        self._before = self._left_out({}, np.zeros(0), linear.parts)

    def candidate(self, hypothesis: ArmHypothesis, extra: Mapping[str, Array], looks: int = 1) -> ArmCandidate:
        """An effect.

        Args:
            hypothesis: the effect.
            extra: its whitened columns by kind, shape (n, k); kinds in which it does nothing are not there.
            looks: number of orders or stiffnesses of which it is the best one.
        """
        linear, kind = self._linear, hypothesis.kind
        size = len(hypothesis.names)
        sigmas = np.full(size, kind.size)
        step, covariance, score = linear.fitted(extra, sigmas)
        p_value = min(looks * float(gammaincc(0.5 * size, max(score, 0.0) / 2.0)), 1.0)
        gains, evidence = self._gains(extra, sigmas)
        evidence -= 2.0 * float(np.log(looks))
        p = len(linear.tied)
        sizes, own = step[p:], np.sqrt(np.diag(covariance))[p:]
        possible = not kind.soft or (bool(np.all(sizes > -own)) and bool(np.any(sizes > own)))
        significant = p_value * self._count < CHANCE
        verdict = "missing" if significant and _shown(gains) and possible else "absent"
        if verdict == "absent" and p_value < 1e-3 and evidence > 0.0 and possible:
            verdict = "possible"
        if np.all(own > TOUCHED * sigmas):
            verdict = "untestable"
        wanted = float(chi2.isf(CHANCE / (self._count * looks), size))
        return ArmCandidate(
            hypothesis, score, p_value, gains, evidence, tuple(sizes.tolist()), tuple(own.tolist()), (), verdict, {},
            looks, wanted,
        )  # fmt: skip

    def explains(self, best: Looked, other: Looked) -> bool:
        """Whether an effect is not missing any more where another one is in the model."""
        linear, (first, extra, _), (hypothesis, more, looks) = self._linear, best, other
        alone = np.full(len(first.names), first.kind.size)
        sigmas = np.append(alone, np.full(len(hypothesis.names), hypothesis.kind.size))
        both = {}
        for part in linear.parts:
            if part.kind in extra or part.kind in more:
                pair = ((extra, len(first.names)), (more, len(hypothesis.names)))
                both[part.kind] = np.hstack([each.get(part.kind, np.zeros((len(part.r), k))) for each, k in pair])
        fall = linear.fitted(both, sigmas)[2] - linear.fitted(extra, alone)[2]
        p_value = min(looks * float(gammaincc(0.5 * len(hypothesis.names), max(fall, 0.0) / 2.0)), 1.0)
        if p_value * self._count >= CHANCE:
            return True
        return not _shown(self._gains(both, sigmas, self._left_out(extra, alone, linear.parts))[0])

    def score(self, hypothesis: ArmHypothesis, extra: Mapping[str, Array]) -> float:
        """Fall of chi2 alone."""
        return self._linear.fitted(extra, np.full(len(hypothesis.names), hypothesis.kind.size))[2]

    def _gains(
        self, extra: Mapping[str, Array], sigmas: Array, before: Mapping[str, Array] | None = None
    ) -> tuple[dict[str, Gain], float]:
        """What columns are worth by kind, and the evidence; beyond a model that is so far off, or the present one."""
        parts = [part for part in self._linear.parts if part.kind in extra]
        before = self._before if before is None else before
        after = self._left_out(extra, sigmas, parts)
        gains, evidence = {}, 0.0
        for part in parts:
            was, now = before[part.kind], after[part.kind]
            left = float(now.sum()) / max(float(was.sum()), 1e-300)
            gains[part.kind] = Gain(1.0 - left, float(np.mean(now < was)))
            evidence -= part.counted * float(np.log(left))
        return gains, evidence

    def _left_out(self, extra: Mapping[str, Array], sigmas: Array, parts: Sequence[LinearKind]) -> dict[str, Array]:
        """Squared distances of each fold of each kind, fitted to all others."""
        found = {}
        for part in parts:
            each = []
            for fold in range(part.folds):
                step, _, _ = self._linear.fitted(extra, sigmas, (part.kind, fold))
                each.append(part.left_out(*self._linear.of(part, extra, step), fold))
            found[part.kind] = np.array(each)
        return found


def _shown(gains: Mapping[str, Gain]) -> bool:
    """Whether a kind shows an effect and none speaks against it."""
    return any(gain.shows for gain in gains.values()) and all(gain.share > -GAIN for gain in gains.values())


def with_look_alikes(
    found: list[ArmCandidate], alike: Mapping[str, list[list[int]]], both: list[list[int]]
) -> list[ArmCandidate]:
    """Names of what does the same, in all kinds together and in each kind alone.

    Args:
        found: all candidates.
        alike: by kind, numbers of those that do the same as each one there.
        both: the same in all kinds together.
    """

    def names(numbers: list[int]) -> tuple[str, ...]:
        best = sorted(((found[j].evidence, found[j].hypothesis.label) for j in numbers), reverse=True)
        return tuple(label for _, label in best[:3])

    return [
        replace(c, look_alikes=names(both[i]), alone={kind: names(each[i]) for kind, each in alike.items() if each[i]})
        for i, c in enumerate(found)
    ]
