# SPDX-License-Identifier: BSD-3-Clause
"""Scores of effects at rest: one linearisation of calibrated rests with a column for every size, states eliminated.

Rests do not touch each other, so each has a reduced system of its own in the shared values; the friction band brings
the gradient of its likelihood and the information that a rest gives on average (factors/friction_band.py).

    S = H_ss - H_sb H_bb^-1 H_bs,   score = s' S^-1 s        s: sizes, b: values of the base model
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.special import chdtrc

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.rest_search.rest_hypotheses import batches
from jointscope.graphs.rest_sets.independent_states import reduced
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.linear_rests import LinearRests
from jointscope.graphs.rests.taken_for_granted import at_null
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.hypothesis_score import HypothesisScore, JointScores
from jointscope.robots.dynamics.at_rest import SLIPPING
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
NONE = 1e-9  # of the prior's information: a column that is smaller is none
GAUGE = 1e-5  # share of a column's information that is left when base values follow: below, they imitate it
SMALLEST_SHARE = 0.1  # of a positive value that one linear step leaves of it
DETERMINED = 0.5  # [prior sigma] a combination of sizes that is known better counts as a degree of freedom


@dataclass(frozen=True)
class RestScore:
    """What a linear step says of an effect.

    Attributes:
        score: at the solution, of its best shapes.
        fall: of chi2 where the linear model with sharp bands has its minimum.
        found: values there, by full name, those of the base model included.
        dof: combinations of sizes that the rests determine.
        p_value: of the fall of the cost by chance, of the best one of all shapes.
        silent: why the rests say nothing of it; empty where they do.
        held: names of sizes that say something of motion alone, and are not estimated.
        column: its place among those of `RestScores.joint`; -1 where it is silent.
    """

    score: HypothesisScore
    dof: int
    p_value: float
    silent: str
    fall: float = 0.0
    found: Mapping[str, float] = field(default_factory=dict)
    held: tuple[str, ...] = ()
    column: int = -1

    @property
    def label(self) -> str:
        """ID@OWNER."""
        return self.score.hypothesis.label


@dataclass(frozen=True)
class RestScores:
    """All effects that were scored, most significant first; `joint` compares those that are not silent."""

    scores: tuple[RestScore, ...]
    joint: JointScores

    def of(self, label: str) -> RestScore | None:
        """The score of an effect; None where it was not looked at."""
        return next((score for score in self.scores if score.label == label), None)

    def alike(self, a: RestScore, b: RestScore) -> float:
        """Largest correlation of what two effects explain beside the base values."""
        return self.joint.correlation(a.column, b.column)


def score_rests(whole: RestSet, robot: Robot, x: Array, hypotheses: Sequence[EffectHypothesis]) -> RestScores:
    """Scores of all effects with their best shapes.

    Args:
        whole: all rests with their weights.
        robot: the calibrated model.
        x: states, shape (m, d).
        hypotheses: what is tried.
    """
    looks: dict[str, int] = {}
    best: dict[str, RestScore] = {}
    for batch in batches(hypotheses):
        for found in _Linear.of(whole, robot, x, batch).scores(batch):
            looks[found.label] = looks.get(found.label, 0) + 1
            if found.label not in best or found.p_value < best[found.label].p_value:
                best[found.label] = found
    linear = _Linear.of(whole, robot, x, [found.score.hypothesis for found in best.values() if not found.silent])
    told = [linear.moved(found) for found in best.values() if not found.silent]
    scores = [replace(f, p_value=min(looks[f.label] * f.p_value, 1.0), column=i) for i, f in enumerate(told)] + [
        found for found in best.values() if found.silent
    ]
    ordered = tuple(sorted(scores, key=lambda f: (bool(f.silent), f.p_value, -f.fall)))
    return RestScores(ordered, linear.joint(told))


@dataclass(frozen=True)
class _Linear:
    """A model with the sizes of some effects, which all are null, linearised; the k sizes stand in `names`.

    Attributes:
        names: full name of each size.
        S, s: Hessian and gradient of the sizes when base values follow, shape (k, k) and (k,).
        alone: information of each size while base values stay, without its prior, shape (k,).
        raw: the same while states stay, too, shape (k,).
        still: the same of motors that do not even creep, shape (k,).
        weight: information of each prior, shape (k,).
        rests: with sharp bands; sizes stand behind the n values of the base model.
        calibration: values at the solution.
    """

    names: tuple[str, ...]
    S: Array
    s: Array
    alone: Array
    raw: Array
    still: Array
    weight: Array
    rests: LinearRests
    calibration: Calibration

    @staticmethod
    def of(whole: RestSet, robot: Robot, x: Array, hypotheses: Sequence[EffectHypothesis]) -> _Linear:
        wide = at_null(robot, hypotheses)
        calibration = Calibration.of(wide).only([DYNAMICS])
        problem = whole.of_robot(wide)
        system = problem.linearize(x, calibration, expected=True)
        H, g = reduced(system)
        free = [wide.parameters[name] for name in calibration.names]
        weight = np.array([1.0 / p.coordinate_sigma**2 for p in free])
        prior = np.array([np.log(p.prior) if p.positive else p.prior for p in free])
        # sizes of effects stand behind the values of the base model, in whose order they were added
        n, raw = len(Calibration.of(robot).names), np.diag(system.C)
        creep = np.sign(whole.rests.creep) * SLIPPING
        slow = replace(problem, rests=replace(problem.rests, creep=creep)).linearize(x, calibration, expected=True).C
        alone, pull = np.diag(H)[n:], weight * (calibration.dynamics - prior)
        H, g = H + np.diag(weight), g + pull
        response = -cho_solve(cho_factor(H[:n, :n]), H[:n, n:])
        S, s = H[n:, n:] + H[n:, :n] @ response, g[n:] + response.T @ g[:n]
        rests = LinearRests.of(problem, x, calibration, weight, pull)
        of_sizes = (alone, raw[n:], np.diag(slow)[n:], weight[n:])
        return _Linear(calibration.names[n:], 0.5 * (S + S.T), s, *of_sizes, rests, calibration)

    @cached_property
    def cost(self) -> float:
        """Of the base model, at the minimum of the linear one."""
        return self.rests.minimum(np.arange(self._base))[1]

    @property
    def _base(self) -> int:
        return len(self.calibration.names) - len(self.names)

    def moved(self, found: RestScore) -> RestScore:
        """A score where the linear model with sharp bands has its minimum, sizes of impossible sign held."""
        h, base, moving = found.score.hypothesis, np.arange(self._base), self._columns(found.score.hypothesis)
        signed = {self.names.index(h.here.parameter(size.name)) for size in h.sizes if size.sign == "+"}
        while True:
            d, cost = self.rests.minimum(np.concatenate([base, self._base + moving]))
            sizes = d[self._base :]
            possible = np.array([size > 0.0 or c not in signed for c, size in zip(moving, sizes, strict=True)], bool)
            if possible.all():
                break
            moving = moving[possible]
        fall = max(2.0 * (self.cost - cost), 0.0) if len(moving) else 0.0
        start, values = self.calibration, np.zeros(self.calibration.size)
        values[base], values[self._base + moving] = d[: self._base], sizes
        step = np.where(start.positive, np.log(np.maximum(1.0 + values, SMALLEST_SHARE)), values)
        named = dict(zip(start.names, start.retract({DYNAMICS: step}).values.tolist(), strict=True))
        estimate = np.array([named[h.here.parameter(size.name)] for size in h.sizes])
        dof = min(found.dof, max(len(moving), 1))
        # edges of bands are sharp: where they say it, a fall of chi2 has twice as many degrees of freedom
        p_value = float(chdtrc(2 * dof, fall)) if len(moving) else 1.0
        score = replace(found.score, estimate=estimate)
        return replace(found, score=score, dof=dof, p_value=p_value, fall=fall, found=named)

    def scores(self, hypotheses: Sequence[EffectHypothesis]) -> list[RestScore]:
        return [self._score(hypothesis) for hypothesis in hypotheses]

    def joint(self, told: Sequence[RestScore]) -> JointScores:
        columns = [self._columns(found.score.hypothesis) for found in told]
        every = np.concatenate([*columns, np.zeros(0, dtype=np.intp)])
        ends = np.cumsum([len(c) for c in columns]).tolist()
        slices = [slice(end - len(c), end) for c, end in zip(columns, ends, strict=True)]
        p_values = np.array([found.p_value for found in told])
        return JointScores(
            [found.score for found in told], p_values, self.S[np.ix_(every, every)], self.s[every], slices
        )

    def _columns(self, hypothesis: EffectHypothesis) -> NDArray[np.intp]:
        names = [self.names.index(hypothesis.here.parameter(size.name)) for size in hypothesis.sizes]
        return np.array(names, dtype=np.intp)

    def _score(self, hypothesis: EffectHypothesis) -> RestScore:
        """Score of the sizes that say something at rest, in the combinations that rests determine."""
        c = self._columns(hypothesis)
        moving = self.still[c] < NONE * np.maximum(self.raw[c], self.weight[c])
        held = tuple(size.name for size, moves in zip(hypothesis.sizes, moving, strict=True) if moves)
        if np.all(moving):
            return RestScore(_score_of(hypothesis, self.S, self.s, c), 1, 1.0, "does nothing at these rests")
        hypothesis = replace(hypothesis, sizes=tuple(size for size in hypothesis.sizes if size.name not in held))
        c = self._columns(hypothesis)
        score = _score_of(hypothesis, self.S, self.s, c)
        if np.all(np.diag(score.S) - self.weight[c] < GAUGE * self.alone[c]):
            return RestScore(score, 1, 1.0, "other values of the model do the same", held=held)
        scale = 1.0 / np.sqrt(self.weight[c])
        dof = int(np.sum(np.linalg.eigvalsh(score.S * np.outer(scale, scale)) > DETERMINED**-2))
        if dof == 0:
            return RestScore(score, 1, 1.0, "far larger sizes than are plausible would not show", held=held)
        value, kept = score.plausible
        dof = min(dof, max(len(kept), 1))
        p_value = float(chdtrc(dof, value)) if kept else 1.0
        signed = len(kept) == 1 and hypothesis.sizes[kept[0]].sign == "+"
        return RestScore(score, dof, 0.5 * p_value if signed else p_value, "", held=held)


def _score_of(hypothesis: EffectHypothesis, S: Array, s: Array, c: NDArray[np.intp]) -> HypothesisScore:
    S, s = S[np.ix_(c, c)], s[c]
    covariance = np.linalg.pinv(S, rcond=1e-12, hermitian=True)
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return HypothesisScore(hypothesis, float(s @ covariance @ s), -covariance @ s, sigma, S, s)
