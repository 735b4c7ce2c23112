# SPDX-License-Identifier: BSD-3-Clause
"""Every effect that a model lacks, scored: best shape, sign, confusions, placebo, several levels of noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from jointscope.graphs.bag_problem import BagProblem
from jointscope.graphs.base_model import BaseModel
from jointscope.graphs.noise_estimation import scaled
from jointscope.graphs.order_scan import scan_orders
from jointscope.graphs.score_test import JointScores, ScoreTest, TrialScore
from jointscope.graphs.trial_signals import TrialSignals
from jointscope.graphs.trial_system import Segment
from jointscope.graphs.trials import Trial, trials_of

Array = NDArray[np.float64]

LONGEST = 30.0  # [s] of one segment: bounds the memory
NOISE_LEVELS = (1.0, 0.3, 0.1)  # factors on the calibrated process noise
ALIKE = 0.95  # correlation of regressors from which two effects cannot be told apart
MOST_ALIKE = 3
MOST_TOGETHER = 60  # candidates whose confusions and robust p-values are worth computing; the rest explain nothing
MOST_AT_LEVELS = 25  # candidates that are scored at other levels of noise
SHIFTS = (0.31, 0.57)  # of the recording by which placebo regressors are moved in time
INDEPENDENT = 0.1  # [s] stretches of this length count as samples where parameters are paid for
SIGNIFICANT = 0.01  # probability, over all candidates together, of a score this large by chance


@dataclass(frozen=True)
class ScoredCandidate:
    """One effect at one owner with its best shapes.

    Attributes:
        best: its score with all sizes.
        plausible: score of the sizes whose sign is possible.
        p_value: block-robust, corrected for the number of candidates (Holm); chi-square for those at the end.
        chance: p-value of the plausible score on the chi-square scale, corrected alike.
        look_alikes: labels of at most three candidates whose regressors correlate above 0.95.
    """

    best: TrialScore
    plausible: float
    p_value: float
    chance: float
    look_alikes: tuple[str, ...]

    @property
    def label(self) -> str:
        """ID@OWNER."""
        return self.best.trial.label

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
    test = ScoreTest(segments)
    best: dict[str, TrialScore] = {}
    for score in test.each(trials_of(base.robot, scan_orders(segments))):
        known = best.get(score.trial.label)
        if known is None or plausible_score(score)[0] > plausible_score(known)[0]:
            best[score.trial.label] = score
    samples = sum(float(np.ptp(segment.signals.ticks)) for segment in segments) / INDEPENDENT
    ordered = sorted(best.values(), key=lambda score: -plausible_score(score)[0] + score.dof * np.log(samples))
    trials = [score.trial for score in ordered[:MOST_TOGETHER]]
    if not trials:
        return ScoredCandidates([], {}, 0.0)
    joint = test.together(trials)
    rest = ordered[MOST_TOGETHER:]
    everyone = [*joint.scores, *rest]
    chances = np.array([chi2.sf(*plausible_score(score)) for score in everyone])
    p_values = _holm(np.concatenate([joint.p_values, chances[len(trials) :]]))
    chances = _holm(chances)
    alike = np.array(
        [[joint.correlation(i, j) if i != j else 0.0 for j in range(len(trials))] for i in range(len(trials))]
    )
    found = []
    for i, score in enumerate(everyone):
        order = np.argsort(-alike[i]) if i < len(trials) else []
        others = [trials[j].label for j in order if alike[i, j] > ALIKE][:MOST_ALIKE]
        value = plausible_score(score)[0]
        found.append(ScoredCandidate(score, value, float(p_values[i]), float(chances[i]), tuple(others)))
    found.sort(key=lambda c: -c.plausible + c.best.dof * np.log(samples))
    levels = {1.0: tuple(c.label for c in found[:5])}
    for level in NOISE_LEVELS[1:]:
        levels[level] = _best_at(level, segments, [c.best.trial for c in found[:MOST_AT_LEVELS]])
    placebo = test.placebo([_placebos(segment.signals) for segment in segments])
    return ScoredCandidates(found, levels, float(np.max(placebo)))


def segments_of(base: BaseModel, bag: int, noise: float = 1.0) -> list[Segment]:
    """One recording in pieces of bounded length, linearised at the base model's solution."""
    ticks, recording = base.problem_ticks(bag), base.recordings[bag]
    count = int(np.ceil((ticks[-1] - ticks[0]) / LONGEST))
    edges = np.linspace(ticks[0], ticks[-1] + 1e-9, count + 1)
    found = []
    for t0, t1 in pairwise(edges):
        part = recording if count == 1 else recording.between(float(t0), float(t1))
        problem = BagProblem.of(base.robot, part)
        x = base.states_at(bag, problem.timeline.ticks, base.layout)
        found.append(Segment.of(problem, x, base.calibrations[bag]))
    return found


def plausible_score(score: TrialScore) -> tuple[float, int]:
    """Largest score of sizes that all have a possible sign, and how many those are."""
    signed = [i for i, size in enumerate(score.trial.sizes) if size.sign == "+"]
    if all(score.estimate[i] > 0 for i in signed):
        return score.score, score.dof
    best = (0.0, 1)
    everything = range(len(score.estimate))
    for count in range(len(score.estimate) - 1, 0, -1):
        for kept in map(list, combinations(everything, count)):
            S, s = score.S[np.ix_(kept, kept)], score.s[kept]
            estimate = -np.linalg.pinv(S, rcond=1e-12, hermitian=True) @ s
            if all(estimate[kept.index(i)] > 0 for i in signed if i in kept):
                best = max(best, (float(-estimate @ s), count))
    return best


def _best_at(level: float, segments: Sequence[Segment], trials: list[Trial]) -> tuple[str, ...]:
    """The five best labels with the process noise multiplied."""
    quieter = []
    for segment in segments:
        noise = segment.problem.dynamics.steps.noise
        factors = np.full(len(noise.link_velocity) + len(noise.motor_velocity) + len(noise.memory), level)
        problem = segment.problem.with_noise(scaled(noise, factors))
        quieter.append(Segment.of(problem, segment.signals.x, segment.calibration))
    scores = ScoreTest(quieter).each(trials)
    scores.sort(key=lambda score: -plausible_score(score)[0])
    return tuple(score.trial.label for score in scores[:5])


def _placebos(s: TrialSignals) -> Array:
    """Motions of the robot at the wrong time, as torques on every equation, shape (m + 1, r, k)."""
    layout, found = s.model.layout, []
    for shift in SHIFTS:
        moved = np.roll(np.arange(len(s.ticks)), int(shift * len(s.ticks)))
        for j in range(len(layout.joints)):
            v = s.x[moved][:, layout.motor_v[j]]
            for signal in (v, np.tanh(200.0 * v), s.tau_spring[moved][:, j]):
                for row in range(layout.n_link + layout.n_motor):
                    tau = np.zeros((len(s.ticks), layout.n_rates))
                    tau[:, row] = signal
                    found.append(s.accelerations(tau))
    return np.stack(found[:: max(len(found) // 18, 1)], axis=2)


def _confusions(joint: JointScores) -> Array:
    """Correlation of every pair of trials, zero with itself, shape (trials, trials)."""
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
