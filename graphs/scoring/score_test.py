# SPDX-License-Identifier: BSD-3-Clause
"""Scores of all hypotheses: what one linear step with each of them would explain, base parameters profiled out.

    score = s' S^-1 s,   estimate = -S^-1 s,   covariance = S^-1

with S, s of the hypothesis's sizes after states and base parameters are eliminated (Rao's score test; in the social
sciences the modification index). Its chi-square distribution holds for white residuals; the robust statistic replaces S
by the sum of squared scores of half-second blocks, which survives coloured ones.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.special import fdtrc

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.priors import shared_priors
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.scoring.columns.column import Column
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.hypothesis_score import HypothesisScore, HypothesisStep, JointScores, fit
from jointscope.graphs.scoring.hypothesis_system import hypothesis_system
from jointscope.graphs.scoring.score_columns import regressors_of
from jointscope.graphs.scoring.score_system import Segment, rows_in_time
from jointscope.graphs.solving.banded_solver import Elimination
from jointscope.graphs.solving.set_problem import owners
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.graphs.solving.solver_context import side_by_side
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

BATCH = 16  # columns at once: bounds the memory; with more, most of the time goes into asking for memory
BLOCK = 0.5  # [s] of the robust variance


class ScoreTest:
    """Scores for recordings that were solved with the base model.

    Args:
        segments: recordings or pieces of them, each with its own biases.
    """

    def __init__(self, segments: Sequence[Segment]):
        self._segments = segments
        self._shared = SharedLayout.of([s.calibration for s in segments], owners([s.problem for s in segments]))

    @staticmethod
    def of(
        problems: Sequence[BagProblem],
        states: Sequence[Array],
        calibrations: Sequence[Calibration],
        eliminations: Sequence[Elimination] | None = None,
    ) -> ScoreTest:
        """The test on whole recordings.

        Args:
            problems: their factors.
            states: their solution.
            calibrations: the values found, with the biases of each recording.
            eliminations: of the states at that solution, where they are at hand.
        """
        known: Sequence[Elimination | None] = eliminations or [None] * len(problems)
        return ScoreTest([Segment.of(*one) for one in zip(problems, states, calibrations, known, strict=True)])

    @property
    def seconds(self) -> float:
        """Length of all recordings together [s]."""
        return sum(float(np.ptp(s.signals.ticks)) for s in self._segments)

    @property
    def robot(self) -> Robot:
        """The robot of the base model."""
        return self._segments[0].problem.robot

    @property
    def calibration(self) -> Calibration:
        """The values of the base model, with the biases of the first recording."""
        return self._segments[0].calibration

    def each(self, hypotheses: Sequence[EffectHypothesis]) -> list[HypothesisScore]:
        """Scores one by one, in batches."""
        found: list[HypothesisScore] = []
        batches = _batches(hypotheses)
        preparations = [prepare for segment in self._segments for prepare in segment.preparations]
        deque(side_by_side(lambda prepare: prepare(), preparations), maxlen=0)
        for batch, (S, s, columns, _, _) in zip(batches, side_by_side(self._profiled, batches), strict=True):
            found += [_score(hypothesis, S[c, c], s[c]) for hypothesis, c in zip(batch, columns, strict=True)]
        return found

    def together(self, hypotheses: Sequence[EffectHypothesis]) -> JointScores:
        """Scores with confusions and robust p-values."""
        S, s, columns, _, (blocks, information) = self._profiled(hypotheses, with_blocks=True)
        scores = [_score(hypothesis, S[c, c], s[c]) for hypothesis, c in zip(hypotheses, columns, strict=True)]
        p = [_robust_p(score, blocks[:, c], own) for score, c, own in zip(scores, columns, information, strict=True)]
        return JointScores(scores, np.array(p), S, s, columns)

    def steps(self, hypotheses: Sequence[EffectHypothesis]) -> list[HypothesisStep]:
        """One linear step with each hypothesis alone."""
        if not hypotheses:
            return []
        S, s, columns, response, (blocks, information) = self._profiled(hypotheses, with_blocks=True)
        found = []
        for hypothesis, c, own in zip(hypotheses, columns, information, strict=True):
            score = _score(hypothesis, S[c, c], s[c])
            at_estimate = blocks[:, c] + own @ score.estimate
            count = max(len(at_estimate), 2)
            inverse = np.linalg.pinv(S[c, c], rcond=1e-12, hermitian=True)
            robust = inverse @ (at_estimate.T @ at_estimate) @ inverse * count / (count - 1.0)
            sigmas = np.maximum(score.sigma, np.sqrt(np.diag(robust)))
            p_value = _robust_p(score, blocks[:, c], own)
            covariances = np.stack([inverse, robust])
            found.append(HypothesisStep(hypothesis, score.estimate, sigmas, response[:, c], p_value, covariances))
        return found

    def values_with(self, step: HypothesisStep) -> dict[str, float]:
        """Each shared value of the dynamics where a step with a hypothesis leads, by name."""
        start = self.calibration
        moved = start.retract({DYNAMICS: step.response[: len(start.names)] @ step.sizes})
        return dict(zip(start.names, moved.values.tolist(), strict=True))

    def change_sigmas(self, step: HypothesisStep) -> dict[str, float]:
        """Standard deviation of what a step changes of each shared value, by name.

        Sizes that are badly known take values with them, as moments of inertia of a link take that of its rotor.
        """
        start = self.calibration
        response = step.response[: len(start.names)]
        variances = np.einsum("ik,nkl,il->ni", response, step.covariances, response)
        scale = np.where(start.positive, np.abs(start.values), 1.0)  # positive values move as logarithms
        return dict(zip(start.names, (scale * np.sqrt(variances.max(axis=0))).tolist(), strict=True))

    def placebo(self, columns: Sequence[Array]) -> Array:
        """Scores of meaningless acceleration regressors, given per segment, shape (m + 1, r, k) each; shape (k,)."""
        k = columns[0].shape[2]
        H, g, _ = self._assembled([[Column(at_ticks=c[:, :, i]) for i in range(k)] for c in columns], k, keep=False)
        S, s, _ = self._profile(H, g, k)
        seen = np.diag(S)
        # a regressor of zeros, as the load of a rigid joint that carries no weight, explains nothing
        return np.divide(s**2, seen, out=np.zeros(k), where=seen > 0.0)

    def _profiled(
        self, hypotheses: Sequence[EffectHypothesis], with_blocks: bool = False
    ) -> tuple[Array, Array, list[slice], Array, tuple[Array, list[Array]]]:
        columns, k = [], 0
        for hypothesis in hypotheses:
            columns.append(slice(k, k + len(hypothesis.sizes)))
            k += len(hypothesis.sizes)
        regressors = [[column for h in hypotheses for column in regressors_of(h, s)] for s in self._segments]
        H, g, W = self._assembled(regressors, k, keep=with_blocks)
        S, s, response = self._profile(H, g, k)
        S = S + np.diag([1.0 / size.prior_sigma**2 for hypothesis in hypotheses for size in hypothesis.sizes])
        blocks = self._blocks(regressors, W, response, columns) if with_blocks else (np.zeros((0, k)), [])
        return S, s, columns, response, blocks

    def _assembled(
        self, regressors: Sequence[Sequence[Column]], k: int, keep: bool
    ) -> tuple[Array, Array, list[Array]]:
        """Hessian and gradient on all shared values and the hypotheses, over all segments, with priors."""
        size, shared = self._shared.size, self._shared
        H, g, Ws = np.zeros((size + k, size + k)), np.zeros(size + k), []
        for i, (segment, columns) in enumerate(zip(self._segments, regressors, strict=True)):
            system = hypothesis_system(segment, rows_in_time(segment, columns), k, keep)
            index = np.concatenate([shared.indices(i), size + np.arange(k)])
            H[np.ix_(index, index)] += system.H
            g[index] += system.g
            Ws.append(system.W)
        calibration = self._segments[0].calibration
        for prior in shared_priors(self._segments[0].problem.robot):
            linear = prior.linearize((), calibration)
            for block, J in linear.by_block.items():
                c, J_white = shared.columns[block], J[0] / prior.sigmas[:, None]
                H[c, c] += J_white.T @ J_white
                g[c] += J_white.T @ (linear.residual[0] / prior.sigmas)
        return H, g, Ws

    def _profile(self, H: Array, g: Array, k: int) -> tuple[Array, Array, Array]:
        """S and s of the hypotheses, and the response of the shared values to each size, shape (shared, k)."""
        n = len(g) - k
        factor = cho_factor(H[:n, :n])
        response = -cho_solve(factor, H[:n, n:])
        S = H[n:, n:] + H[n:, :n] @ response
        return 0.5 * (S + S.T), g[n:] + response.T @ g[:n], response

    def _blocks(
        self,
        regressors: Sequence[Sequence[Column]],
        Ws: Sequence[Array],
        response: Array,
        columns: Sequence[slice],
    ) -> tuple[Array, list[Array]]:
        """Scores, shape (blocks, k), and information of every hypothesis, shape (blocks, k_own, k_own)."""
        k = response.shape[1]
        scores = list[Array]()
        information: list[list[Array]] = [[] for _ in columns]
        for i, (segment, own_columns) in enumerate(zip(self._segments, regressors, strict=True)):
            base, dp = segment.elimination, response[self._shared.indices(i)]
            dx = base.solve_transposed(-(Ws[i] + base.W @ dp)).reshape(-1, base.d, k)
            ticks = segment.problem.timeline.ticks
            block = ((ticks - ticks[0]) / BLOCK).astype(int)
            count, blocks = int(block[-1]) + 1, segment.calibration.columns
            total = np.zeros((count, k))
            own = [np.zeros((count, c.stop - c.start, c.stop - c.start)) for c in columns]
            for part in rows_in_time(segment, own_columns):
                # residuals change with states and base parameters following along
                moved = part.by_size + sum(J @ dp[blocks[b]] for b, J in part.by_block.items())
                for j, J in enumerate(part.by_state):
                    moved = moved + J @ dx[part.ticks + j]
                sums = _sums_by(block[part.ticks])
                sums(total, (part.residual[:, None] @ moved)[:, 0])
                for c, target in zip(columns, own, strict=True):
                    chosen = moved[:, :, c]
                    sums(target, chosen.transpose(0, 2, 1) @ chosen)
            scores.append(total)
            for found, values in zip(information, own, strict=True):
                found.append(values)
        return np.vstack(scores), [np.vstack(values) for values in information]


def _sums_by(block: NDArray[np.intp]) -> Callable[[Array, Array], None]:
    """Adds samples to their blocks; samples are in the order of time."""
    first = np.flatnonzero(np.diff(block, prepend=block[0] - 1))

    def add(target: Array, values: Array) -> None:
        target[block[first]] += np.add.reduceat(values, first, axis=0)

    return add


def _score(hypothesis: EffectHypothesis, S: Array, s: Array) -> HypothesisScore:
    covariance = np.linalg.pinv(S, rcond=1e-12, hermitian=True)
    estimate = -covariance @ s
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return HypothesisScore(hypothesis, float(s @ covariance @ s), estimate, sigma, S, s)


def _robust_p(score: HypothesisScore, scores: Array, information: Array) -> float:
    """P-value of the one-step estimate against the spread of what half-second blocks say about it.

    A block's score at the estimate is its score at null plus information times estimate; where the effect is real
    these scatter about zero however unevenly the evidence is spread over time. Hotelling's T^2 with as many degrees of
    freedom as there are blocks that carry information. Only sizes with a possible sign count, 1 where there are none;
    half where there is one size whose sign is known. NaN where too few blocks carry information.
    """
    kept = list(score.plausible[1])
    if not kept:
        return 1.0
    estimate, _ = fit(score.S[np.ix_(kept, kept)], score.s[kept])
    scores, information = scores[:, kept], information[:, kept][:, :, kept]
    k, total = score.dof, information.sum(axis=0)
    weight = np.einsum("bii->b", information)
    b = float(weight.sum() ** 2 / np.sum(weight**2)) if np.any(weight) else 0.0
    if b <= k + 1.5:
        return float("nan")
    at_estimate = scores + information @ estimate
    spread = at_estimate.T @ at_estimate * b / (b - 1.0)
    pull = total @ estimate
    statistic = max(float(pull @ np.linalg.pinv(spread, rcond=1e-10, hermitian=True) @ pull), 0.0)
    p = float(fdtrc(k, b - k, statistic * (b - k) / (k * (b - 1.0))))
    return 0.5 * p if len(kept) == 1 and score.hypothesis.sizes[kept[0]].sign == "+" else p


def _batches(hypotheses: Sequence[EffectHypothesis]) -> list[list[EffectHypothesis]]:
    batches: list[list[EffectHypothesis]] = [[]]
    for hypothesis in hypotheses:
        if batches[-1] and sum(len(t.sizes) for t in batches[-1]) + len(hypothesis.sizes) > BATCH:
            batches.append([])
        batches[-1].append(hypothesis)
    return batches
