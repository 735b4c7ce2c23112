# SPDX-License-Identifier: BSD-3-Clause
"""Significance and size of candidates, asked one by one: a score at the yardstick noise, and blocks left out.

Every candidate is fitted beside the base parameters on three quarters of the blocks, at one noise for all; on the
others its share is the part of the squared missing torque that went. What is significant and small is told, not added.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.judging.elastic_reaction import is_spring
from jointscope.graphs.judging.free_curves import hats, over_speed, stacked
from jointscope.graphs.judging.row_blocks import blocks_of
from jointscope.graphs.judging.shape_search import Fitted, between_shapes
from jointscope.graphs.judging.torque_noise import Yardstick, independent, saturated, yardstick_of
from jointscope.graphs.judging.torque_rows import TorqueEquations
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis

Array = NDArray[np.float64]

FEWEST_BLOCKS, FOLDS = 8, 4
NET, SHARE, COMMON = 12.0, 0.05, 0.02  # significance; share of the own equations, of all
HELPED, HELPED_BY_COMMAND = 0.8, 0.9  # of the blocks
HARM, CEILING = 1.5, 0.5
ABSOLUTE = 0.003  # of the drive: what is taken away must be larger
WORTH = 0.01  # of the drive: what is taken away need not be larger than the random torque beside it
SMALL = "there, but small"  # how a refusal begins of what is significant and not worth a parameter
GAUGE = 1e-4  # of a column's square outside the base columns
DRIVEN = ("pwm_deadband", "truncated_command", "command_delay", "motor_lag")  # the loop bends commands to disturbances


@dataclass(frozen=True)
class TorqueJudgement:
    """What the missing torque says about one candidate.

    Attributes:
        hypothesis: with its best shapes.
        net: score at the yardstick noise less what sizes and shapes cost.
        score: the same without these costs.
        sizes, sigmas: shape (k,); zero and infinite where the other sizes and base parameters imitate one.
        share, common: of the squared missing torque on blocks left out, in its own equations and in all.
        helped, blocks: on how many of how many blocks.
        harm: largest ratio of missing torques on a block.
        removed: root mean square of what it takes away, in percent of the drive.
        refused: why it is not let in, in plain words; empty if it is.
    """

    hypothesis: EffectHypothesis
    net: float
    score: float
    sizes: Array
    sigmas: Array
    share: float
    common: float
    helped: int
    blocks: int
    harm: float
    removed: float
    refused: str = ""

    @property
    def small(self) -> bool:
        """Whether it is there, but not worth a parameter."""
        return self.refused.startswith(SMALL)

    @property
    def dof(self) -> int:
        """Number of sizes that are told."""
        return int(np.sum(np.isfinite(self.sigmas)))


class TorqueJudge:
    """Judges hypotheses on the rows of all equations."""

    def __init__(self, equations: TorqueEquations):
        self.equations, self.rows = equations, equations.rows
        self.blocks = [blocks_of(rows) for rows in self.rows]
        self.noise: list[Yardstick] = [yardstick_of(r, b) for r, b in zip(self.rows, self.blocks, strict=True)]
        self.drive = np.array([_rms(r.drive) for r in self.rows])
        self._everything = np.vstack([rows.base for rows in self.rows])
        self.left = self._left_out(np.zeros((len(self._everything), 0)))
        self.ceiling = self._ceiling()

    @property
    def samples(self) -> int:
        """Rows of all equations."""
        return len(self._everything)

    @property
    def missing(self) -> Array:
        """Root mean square of the missing torque of each equation on blocks left out, shape (n,) [N m]."""
        return np.sqrt([float(np.mean(r**2)) for r in self._split(self.left)])

    @property
    def unexplained(self) -> float:
        """Share of the squared missing torque that smooth laws would explain on blocks left out, 0 to 1."""
        smooth = self._left_out(stacked([independent(saturated(rows)) for rows in self.rows]))
        return max(self._common(smooth), 0.0)

    def judge(self, hypotheses: Sequence[EffectHypothesis]) -> TorqueJudgement | None:
        """The best of hypotheses that differ in their shapes alone; None for what does not act through torques."""
        found: list[Fitted] = []
        for hypothesis in hypotheses:
            fitted = self._fit(hypothesis)
            if fitted is None:
                return None
            found.append(fitted)
        best = max(found, key=lambda fitted: fitted.score)
        if best.score > 0.0:
            best = between_shapes(self._fit, best, hypotheses)
        C = best.columns[:, np.isfinite(best.sigmas)]
        net = best.score - C.shape[1] * np.log(self.samples) - 2.0 * np.log(len(hypotheses))
        return self._judged(best.hypothesis, best.score, float(net), best.sizes, best.sigmas, C)

    def _fit(self, hypothesis: EffectHypothesis) -> Fitted | None:
        """Score and sizes of one hypothesis; None for what does not act through torques."""
        columns = self.equations.columns(hypothesis)
        if columns is None:
            return None
        C = np.vstack(columns)
        return Fitted(hypothesis, C, *self._score(C, hypothesis))

    def _judged(
        self, hypothesis: EffectHypothesis, score: float, net: float, sizes: Array, sigmas: Array, C: Array
    ) -> TorqueJudgement:
        if score <= 0.0:
            text = "the base parameters imitate it, or the data want the impossible sign"
            return TorqueJudgement(hypothesis, net, 0.0, sizes, sigmas, 0.0, 0.0, 0, 0, 1.0, 0.0, text)
        left, own = self._left_out(C), self._own(C @ sizes[np.isfinite(sigmas)])
        before, after, ratios = 0.0, 0.0, []
        for j, (r0, r1) in enumerate(zip(self._split(self.left), self._split(left), strict=True)):
            if not own[j]:
                continue
            before, after = before + float(r0 @ r0) / self.drive[j] ** 2, after + float(r1 @ r1) / self.drive[j] ** 2
            ratios.append(_by_block(r0, r1, self.blocks[j]))
        pairs = np.vstack(ratios)
        floor = 0.25 * float(np.median(pairs[:, 0]))
        helped, harm = (
            int(np.sum(pairs[:, 1] < pairs[:, 0])),
            float(np.max(pairs[:, 1] / np.maximum(pairs[:, 0], floor))),
        )
        rows = sum(len(r) for r, yes in zip(self._split(self.left), own, strict=True) if yes)
        removed = 100.0 * float(np.sqrt(max(before - after, 0.0) / rows))
        found = TorqueJudgement(
            hypothesis,
            net,
            score,
            sizes,
            sigmas,
            1.0 - after / before,
            self._common(left),
            helped,
            len(pairs),
            harm,
            removed,
        )
        noise = np.array([n.size for n in self.noise]) / self.drive
        return replace(found, refused=self._refusal(found, 100.0 * _rms(noise[own])))

    def _refusal(self, found: TorqueJudgement, random: float) -> str:
        """Why a candidate is not let in; `random`: torque that follows no law, in percent of the drive."""
        needed = HELPED_BY_COMMAND if found.hypothesis.here.effect.id in DRIVEN else HELPED
        if found.net <= NET:
            return "it would explain no more than chance beside disturbances with a memory"
        least = max(100.0 * ABSOLUTE, min(100.0 * WORTH, random))
        if found.share <= SHARE or found.common <= COMMON or found.removed <= least:
            share = f"{100 * max(found.share, 0.0):.1f} % of the squared missing torque"
            return f"{SMALL}: {share}, {found.removed:.2g} % of the drive's"
        if found.helped < needed * found.blocks:
            return f"it helps on {found.helped} of {found.blocks} blocks left out"
        if found.harm > HARM:
            return f"on one block left out it makes the missing torque {found.harm:.1f} times larger"
        if found.share < CEILING * self.ceiling:
            return (
                "a free curve over position or speed explains more than twice as much: it stands in for something else"
            )
        return ""

    @cached_property
    def _beside_base(self) -> tuple[Array, Array]:
        """Orthonormal base columns, shape (m + p, p), and what they leave of the missing torque, shape (m + p,).

        Both whitened, with the p priors of base parameters below: rows outside standstill leave some to them alone.
        """
        X, y = self._fitted
        Q = np.linalg.qr(X)[0]
        return Q, y - Q @ (Q.T @ y)

    @cached_property
    def _fitted(self) -> tuple[Array, Array]:
        """Base columns, shape (m + p, p), and missing torque, shape (m + p,), whitened, in prior sigmas."""
        expected, sigma = self.equations.expected, self.equations.sigma
        X, y = self._white(self._everything), self._white(self._target)[:, 0]
        return np.vstack([X * sigma, np.eye(len(sigma))]), np.concatenate([y, expected / sigma])

    def _score(self, C: Array, hypothesis: EffectHypothesis) -> tuple[float, Array, Array]:
        """Score, sizes and their sigmas beside the base parameters; score 0 for gauges and impossible signs."""
        k, none = C.shape[1], (0.0, np.zeros(C.shape[1]), np.full(C.shape[1], np.inf))
        (Q, r), priors = self._beside_base, len(self.equations.sigma)
        Z = np.vstack([self._white(C), np.zeros((priors, k))])
        rest = Z - Q @ (Q.T @ Z)
        told = _told(rest, np.sum(Z**2, axis=0))
        rest = rest[:, told]
        S = rest.T @ rest + np.diag([1.0 / hypothesis.sizes[i].prior_sigma ** 2 for i in told])
        s = rest.T @ r
        covariance = np.linalg.pinv(S, hermitian=True)
        sizes, sigmas = np.zeros(k), np.full(k, np.inf)
        sizes[told], sigmas[told] = covariance @ s, np.sqrt(np.diag(covariance))
        possible = all(size >= 0.0 for size, p in zip(sizes, hypothesis.sizes, strict=True) if p.sign == "+")
        # no effect is larger than the drive that overcomes it; a load near its resonance carries itself
        acts = [0.0 if is_spring(hypothesis) else _rms(part @ sizes) for part in self._split(C)]
        if not possible or not told or np.any(np.array(acts) > self.drive):
            return none
        return float(s @ sizes[told]), sizes, sigmas

    def _left_out(self, C: Array) -> Array:
        """Missing torque with base parameters and columns fitted on the other folds, shape (m,)."""
        (X, y), m = self._fitted, len(C)
        fitted = np.hstack([X, np.vstack([self._white(C), np.zeros((len(X) - m, C.shape[1]))])])
        columns = np.hstack([self._everything * self.equations.sigma, C])
        folds = np.concatenate([*(b % FOLDS for b in self.blocks), np.full(len(X) - m, FOLDS)])
        left = np.empty(m)
        for fold in range(FOLDS):
            judged = folds[:m] == fold
            beta = np.linalg.lstsq(fitted[folds != fold], y[folds != fold], rcond=1e-10)[0]
            left[judged] = self._target[judged, 0] - columns[judged] @ beta
        return left

    def _white(self, values: Array) -> Array:
        parts = zip(self.noise, self.rows, self._split(values), self.blocks, strict=True)
        return np.vstack([noise.whitened(rows.times, own, blocks) for noise, rows, own, blocks in parts])

    @property
    def _target(self) -> Array:
        return np.concatenate([rows.missing for rows in self.rows])[:, None]

    def _split(self, values: Array) -> list[Array]:
        return np.split(values, np.cumsum([len(rows.times) for rows in self.rows])[:-1])

    def _own(self, torque: Array) -> list[bool]:
        """Equations in which a candidate does what is worth telling; the one where it does most, if it does so nowhere.

        A wrong torque constant is a matter of one joint, a wrong mass may be one of few: the others neither need its
        help nor feel its harm.
        """
        acts = np.array([_rms(part) for part in self._split(torque)]) / self.drive
        return [bool(does) for does in acts >= min(ABSOLUTE, float(np.max(acts)))]

    def _common(self, left: Array) -> float:
        def weighed(parts: list[Array]) -> float:
            return float(sum(np.mean(p**2) / d**2 for p, d in zip(parts, self.drive, strict=True)))

        return 1.0 - weighed(self._split(left)) / weighed(self._split(self.left))

    def _ceiling(self) -> float:
        """Share that free curves over position or over speed explain on blocks left out; 0 where they run away."""
        curves = ([hats(r.q) for r in self.rows], [over_speed(r.v) for r in self.rows])
        return max(0.0, *(self._common(self._left_out(stacked(c))) for c in curves))


def _told(rest: Array, whole: Array) -> list[int]:
    """Columns of which base parameters, and those before, leave something; of these the squares, shape (k,)."""
    kept, basis = list[int](), np.zeros((len(rest), 0))
    for i, column in enumerate(rest.T):
        own = column - basis @ (basis.T @ column)
        square = float(own @ own)
        if square > GAUGE * whole[i]:
            kept, basis = [*kept, i], np.column_stack([basis, own / np.sqrt(square)])
    return kept


def _by_block(before: Array, after: Array, blocks: NDArray[np.intp]) -> Array:
    return np.array([[_rms(before[blocks == b]), _rms(after[blocks == b])] for b in np.unique(blocks)])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
