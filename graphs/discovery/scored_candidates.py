# SPDX-License-Identifier: BSD-3-Clause
"""Every effect that a model lacks, scored: best shape, sign, confusions, placebo, several levels of noise."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise, product

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from jointscope.graphs.calibration.base_model import BaseModel
from jointscope.graphs.noise.noise_estimation import scaled
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.scoring.columns.gap import gap_hypotheses
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis, hypotheses_of
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.graphs.scoring.hypothesis_score import HypothesisScore, JointScores, best_shapes
from jointscope.graphs.scoring.order_scan import scan_orders
from jointscope.graphs.scoring.score_system import Segment
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.graphs.starts.spring_knots import deflections_of

Array = NDArray[np.float64]

LONGEST = 30.0  # [s] of one segment: bounds the memory
NOISE_LEVELS = (1.0, 0.3, 0.1)  # factors on the calibrated process noise
ALIKE = 0.95  # correlation of regressors from which two effects cannot be told apart
MOST_ALIKE = 3
MOST_TOGETHER = 60  # candidates whose confusions and robust p-values are worth computing; the rest explain nothing
MOST_AT_LEVELS = 25  # candidates that are scored at other levels of noise
BEST = 5  # candidates named at each level of noise
PLACEBOS = 18
SHIFTS = (0.31, 0.57)  # of the recording by which placebo regressors are moved in time
SIGNIFICANT = 0.01  # probability, over all candidates together, of a score this large by chance


@dataclass(frozen=True)
class ScoredCandidate:
    """One effect at one owner with its best shapes.

    Attributes:
        best: its score with all sizes.
        plausible: score of the sizes whose sign is possible.
        p_value: block-robust, corrected for the shapes tried and the number of candidates (Holm); on the chi-square
            scale where too few blocks carry information, and for those at the end.
        chance: p-value of the plausible score on the chi-square scale, corrected alike.
        look_alikes: labels of at most three candidates whose regressors correlate above 0.95.
    """

    best: HypothesisScore
    plausible: float
    p_value: float
    chance: float
    look_alikes: tuple[str, ...]

    @property
    def label(self) -> str:
        """ID@OWNER."""
        return self.best.hypothesis.label

    @property
    def right_sign(self) -> bool:
        """Whether any size could have the sign that the data want."""
        return self.plausible > 0.0


@dataclass(frozen=True)
class ScoredCandidates:
    """All candidates, best first: by plausible score less what their parameters cost (dof log samples).

    Attributes:
        candidates: sorted.
        noise_levels: the five best labels at each factor on the calibrated noise.
        placebo: largest score per degree of freedom of meaningless regressors.
    """

    candidates: list[ScoredCandidate]
    noise_levels: dict[float, tuple[str, ...]]
    placebo: float


def score_candidates(base: BaseModel) -> ScoredCandidates:
    """Scores the whole catalogue on the training recordings."""
    segments = [s for bag in range(len(base.recordings)) for s in segments_of(base, bag)]
    test, scan = ScoreTest(segments), scan_orders(segments)
    hidden, tried = gap_hypotheses([segment.signals for segment in segments]), Counter[str]()
    deflections = deflections_of(base.robot, [segment.signals.seen for segment in segments])
    scores = test.each([*hypotheses_of(base.robot, scan.orders, deflections=deflections), *hidden])
    for label in (score.hypothesis.label for score in scores):
        tried[label] += scan.searched.get(label, 1)

    def worth(score: HypothesisScore) -> float:
        return score.worth(test.seconds)

    ordered = _best_of_families(sorted(best_shapes(scores).values(), key=worth, reverse=True))
    hypotheses = [score.hypothesis for score in ordered[:MOST_TOGETHER]]
    if not hypotheses:
        return ScoredCandidates([], {}, 0.0)
    joint = test.together(hypotheses)
    everyone = [*joint.scores, *ordered[MOST_TOGETHER:]]
    # the best of several shapes is the best of as many draws
    draws = np.array([tried[score.hypothesis.label] for score in everyone])
    chances = np.minimum(np.array([chdtrc(score.dof, max(score.plausible[0], 0.0)) for score in everyone]) * draws, 1.0)
    robust = np.minimum(np.concatenate([joint.p_values, np.full(len(everyone) - len(hypotheses), np.nan)]) * draws, 1.0)
    p_values, chances = _holm(np.where(np.isfinite(robust), robust, chances)), _holm(chances)
    alike = _confusions(joint)
    found = []
    for i, score in enumerate(everyone):
        order = np.argsort(-alike[i]) if i < len(hypotheses) else np.zeros(0, np.intp)
        others = [hypotheses[j].label for j in order if alike[i, j] > ALIKE][:MOST_ALIKE]
        found.append(ScoredCandidate(score, score.plausible[0], float(p_values[i]), float(chances[i]), tuple(others)))
    found.sort(key=lambda candidate: worth(candidate.best), reverse=True)
    levels = {1.0: tuple(c.label for c in found[:BEST])}
    for level in NOISE_LEVELS[1:]:
        scores = _at_noise(level, segments, [c.best.hypothesis for c in found[:MOST_AT_LEVELS]])
        levels[level] = tuple(score.hypothesis.label for score in sorted(scores, key=worth, reverse=True)[:BEST])
    placebo = test.placebo([_placebos(segment.signals) for segment in segments])
    return ScoredCandidates(found, levels, float(np.max(placebo)))


def _best_of_families(ordered: Sequence[HypothesisScore]) -> list[HypothesisScore]:
    """Of laws that differ in their detail alone the one that is worth most, which stands first.

    A score less dof log samples is the logarithm of the marginal likelihood to first order: the number of knots of a
    curve is chosen by it.
    """
    found: dict[str, HypothesisScore] = {}
    for score in ordered:
        found.setdefault(score.hypothesis.here.family, score)
    return list(found.values())


def segments_of(base: BaseModel, bag: int) -> list[Segment]:
    """One recording in pieces of bounded length, linearised at the base model's solution."""
    ticks, recording = base.problem_ticks(bag), base.recordings[bag]
    count = int(np.ceil((ticks[-1] - ticks[0]) / LONGEST))
    edges = np.linspace(ticks[0], ticks[-1] + 1e-9, count + 1)
    found = []
    for t0, t1 in pairwise(edges):
        part = recording if count == 1 else recording.between(float(t0), float(t1))
        problem = replace(BagProblem.of(base.robot, part, base.between(bag)), owner=bag)
        x = base.states_at(bag, problem.timeline.ticks, base.layout)
        found.append(Segment.of(problem, x, base.calibrations[bag]))
    return found


def _at_noise(level: float, segments: Sequence[Segment], hypotheses: list[EffectHypothesis]) -> list[HypothesisScore]:
    """Scores with the process noise multiplied."""
    quieter = []
    for segment in segments:
        noise = segment.problem.dynamics.steps.noise
        factors = np.full(len(noise.link_velocity) + len(noise.motor_velocity) + len(noise.memory), level)
        quieter.append(segment.with_noise(scaled(noise, factors)))
    return ScoreTest(quieter).each(hypotheses)


def _placebos(s: ScoreSignals) -> Array:
    """Motions of the robot at the wrong time, as torques on all equations in turn, shape (m + 1, r, k)."""
    layout, found = s.model.layout, []
    rows = range(layout.n_link + layout.n_motor)
    plan = list(product(SHIFTS, range(len(layout.joints)), range(3), rows))
    chosen = np.unique(np.linspace(0, len(plan) - 1, min(PLACEBOS, len(plan))).round().astype(int))
    for shift, j, kind, row in (plan[i] for i in chosen):
        moved = np.roll(np.arange(len(s.ticks)), int(shift * len(s.ticks)))
        v = s.x[moved][:, layout.motor_v[j]]
        tau = np.zeros((len(s.ticks), layout.n_rates))
        tau[:, row] = (v, np.tanh(s.robot.sharpness_of(layout.joints[j]) * v), s.tau_spring[moved][:, j])[kind]
        found.append(s.accelerations(tau))
    return np.stack(found, axis=2)


def _confusions(joint: JointScores) -> Array:
    """Correlation of every pair of hypotheses, zero with itself, shape (hypotheses, hypotheses)."""
    count = len(joint.scores)
    alike = np.zeros((count, count))
    for i, j in combinations(range(count), 2):
        alike[i, j] = alike[j, i] = joint.correlation(i, j)
    return alike


def _holm(p: Array) -> Array:
    """P-values corrected for their number, step down."""
    order = np.argsort(p)
    corrected = np.maximum.accumulate(p[order] * (len(p) - np.arange(len(p))))
    result = np.empty(len(p))
    result[order] = np.minimum(corrected, 1.0)
    return result
