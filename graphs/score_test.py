# SPDX-License-Identifier: BSD-3-Clause
"""Scores of all trials: what one linear step with each of them would explain, base parameters profiled out.

    score = s' S^-1 s,   estimate = -S^-1 s,   covariance = S^-1

with S, s of the trial's sizes after states and base parameters are eliminated (Rao's score test; in the social
sciences the modification index). Its chi-square distribution holds for white residuals; the robust statistic replaces S
by the sum of squared scores of half-second blocks, which survives coloured ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import chi2

from jointscope.graphs.batch_solver import priors_of
from jointscope.graphs.shared_layout import SharedLayout
from jointscope.graphs.trial_columns import columns_of
from jointscope.graphs.trial_system import Segment, TrialRows, rows_of, trial_system
from jointscope.graphs.trials import Trial

Array = NDArray[np.float64]

BATCH = 64  # columns at once: bounds the memory
BLOCK = 0.5  # [s] of the robust variance


@dataclass(frozen=True)
class TrialScore:
    """What the recordings say about one trial without a refit.

    Attributes:
        trial: effect, owner, shapes.
        score: s' S^-1 s.
        estimate: of the sizes, shape (k,).
        sigma: their standard deviations, shape (k,).
        alone: score that each size has for itself, shape (k,).
    """

    trial: Trial
    score: float
    estimate: Array
    sigma: Array
    alone: Array

    @property
    def dof(self) -> int:
        """Number of sizes."""
        return len(self.estimate)


@dataclass(frozen=True)
class JointScores:
    """Trials scored together.

    Attributes:
        scores: one per trial.
        p_values: block-robust, shape (trials,).
        S: profiled Hessian of all sizes, shape (k, k).
        s: profiled gradient, shape (k,).
        columns: sizes of each trial among the k.
    """

    scores: list[TrialScore]
    p_values: Array
    S: Array
    s: Array
    columns: list[slice]

    def correlation(self, a: int, b: int) -> float:
        """Largest correlation between what two trials can explain, 0 to 1."""
        S = self.S
        A, B = self.columns[a], self.columns[b]
        Q_a, Q_b = (np.linalg.pinv(_root(S[c, c])) for c in (A, B))
        return float(np.linalg.svd(Q_a.T @ S[A, B] @ Q_b, compute_uv=False)[0])


class ScoreTest:
    """Scores for recordings that were solved with the base model.

    Args:
        segments: recordings or pieces of them, each with its own biases.
    """

    def __init__(self, segments: Sequence[Segment]):
        self._segments = segments
        self._shared = SharedLayout.of(segments[0].calibration, len(segments))

    def each(self, trials: Sequence[Trial]) -> list[TrialScore]:
        """Scores one by one, in batches."""
        found: list[TrialScore] = []
        for batch in _batches(trials):
            S, s, columns, _ = self._profiled(batch)
            found += [_score(trial, S[c, c], s[c]) for trial, c in zip(batch, columns, strict=True)]
        return found

    def together(self, trials: Sequence[Trial]) -> JointScores:
        """Scores with confusions and robust p-values."""
        S, s, columns, blocks = self._profiled(trials, with_blocks=True)
        scores = [_score(trial, S[c, c], s[c]) for trial, c in zip(trials, columns, strict=True)]
        assert blocks is not None
        p = [_robust_p(trial, blocks[:, c], score) for trial, c, score in zip(trials, columns, scores, strict=True)]
        return JointScores(scores, np.array(p), S, s, columns)

    def placebo(self, columns: Sequence[Array]) -> Array:
        """Scores of meaningless acceleration regressors, given per segment, shape (m + 1, r, k) each; shape (k,)."""
        from jointscope.graphs.trial_columns import Column

        k = columns[0].shape[2]
        parts = [
            rows_of(segment, [Column(at_ticks=c[:, :, i]) for i in range(k)])
            for segment, c in zip(self._segments, columns, strict=True)
        ]
        H, g = self._assembled(parts, k)[:2]
        S, s, _ = self._profile(H, g, k)
        return s**2 / np.diag(S)

    def _profiled(
        self, trials: Sequence[Trial], with_blocks: bool = False
    ) -> tuple[Array, Array, list[slice], Array | None]:
        parts, columns, k = [], [], 0
        for trial in trials:
            columns.append(slice(k, k + len(trial.sizes)))
            k += len(trial.sizes)
        for segment in self._segments:
            regressors = [column for trial in trials for column in columns_of(trial, segment.signals)]
            parts.append(rows_of(segment, regressors))
        H, g, W = self._assembled(parts, k)
        S, s, response = self._profile(H, g, k)
        S = S + np.diag([1.0 / size.prior_sigma**2 for trial in trials for size in trial.sizes])
        blocks = self._block_scores(parts, W, response, k) if with_blocks else None
        return S, s, columns, blocks

    def _assembled(self, parts: Sequence[Sequence[TrialRows]], k: int) -> tuple[Array, Array, list[Array]]:
        """Hessian and gradient on all shared values and the trials, over all segments, with priors."""
        size, shared = self._shared.size, self._shared
        H, g, Ws = np.zeros((size + k, size + k)), np.zeros(size + k), []
        for i, (segment, rows) in enumerate(zip(self._segments, parts, strict=True)):
            system = trial_system(segment, rows, k)
            index = np.concatenate([shared.indices(i), size + np.arange(k)])
            H[np.ix_(index, index)] += system.H
            g[index] += system.g
            Ws.append(system.W)
        calibration = self._segments[0].calibration
        for prior in priors_of(self._segments[0].problem):
            linear = prior.linearize((), calibration)
            for block, J in linear.by_block.items():
                c, J_white = shared.columns[block], J[0] / prior.sigmas[:, None]
                H[c, c] += J_white.T @ J_white
                g[c] += J_white.T @ (linear.residual[0] / prior.sigmas)
        return H, g, Ws

    def _profile(self, H: Array, g: Array, k: int) -> tuple[Array, Array, Array]:
        """S and s of the trials, and the response of the shared values to each size, shape (shared, k)."""
        n = len(g) - k
        factor = cho_factor(H[:n, :n])
        response = -cho_solve(factor, H[:n, n:])
        S = H[n:, n:] + H[n:, :n] @ response
        return 0.5 * (S + S.T), g[n:] + response.T @ g[:n], response

    def _block_scores(
        self, parts: Sequence[Sequence[TrialRows]], Ws: Sequence[Array], response: Array, k: int
    ) -> Array:
        """Scores of blocks of time with states and base parameters following along, shape (blocks, k)."""
        found = []
        for i, (segment, rows) in enumerate(zip(self._segments, parts, strict=True)):
            base, dp = segment.elimination, response[self._shared.indices(i)]
            right = -(Ws[i] + base.W @ dp)
            dx = base.solve_transposed(right).reshape(-1, base.d, k)
            # residuals move with the step that the base model itself would still take
            ticks = segment.problem.timeline.ticks
            block = ((ticks - ticks[0]) / BLOCK).astype(int)
            total = np.zeros((int(block[-1]) + 1, k))
            columns = self._shared.columns
            for part in rows:
                moved = part.by_trial + sum(J @ dp[columns[b]] for b, J in part.by_block.items())
                for j, J in enumerate(part.by_state):
                    moved = moved + J @ dx[part.ticks + j]
                score = np.einsum("srk,sr->sk", moved, part.residual)
                np.add.at(total, block[part.ticks], score)
            found.append(total)
        return np.vstack(found)


def _score(trial: Trial, S: Array, s: Array) -> TrialScore:
    covariance = np.linalg.pinv(S, rcond=1e-12, hermitian=True)
    estimate = -covariance @ s
    alone = s**2 / np.maximum(np.diag(S), 1e-300)
    return TrialScore(trial, float(s @ covariance @ s), estimate, np.sqrt(np.maximum(np.diag(covariance), 0.0)), alone)


def _robust_p(trial: Trial, blocks: Array, score: TrialScore) -> float:
    """P-value of the summed block scores against their own spread; half where the sign must be right, 1 where it is wrong."""
    total = blocks.sum(axis=0)
    centred = blocks - blocks.mean(axis=0)
    spread = centred.T @ centred * len(blocks) / max(len(blocks) - 1, 1)
    statistic = float(total @ np.linalg.pinv(spread, rcond=1e-10, hermitian=True) @ total)
    k, b = len(total), len(blocks)
    # Hotelling: the spread itself is estimated from b blocks
    from scipy.stats import f as fisher

    p = float(fisher.sf(statistic * (b - k) / (k * (b - 1)), k, b - k)) if b > k + 1 else float(chi2.sf(statistic, k))
    if k == 1 and trial.sizes[0].sign == "+":
        return 0.5 * p if score.estimate[0] > 0 else 1.0
    return p


def _batches(trials: Sequence[Trial]) -> list[list[Trial]]:
    batches: list[list[Trial]] = [[]]
    for trial in trials:
        if batches[-1] and sum(len(t.sizes) for t in batches[-1]) + len(trial.sizes) > BATCH:
            batches.append([])
        batches[-1].append(trial)
    return batches


def _root(S: Array) -> Array:
    """Symmetric square root."""
    values, vectors = np.linalg.eigh(S)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T, dtype=np.float64)
