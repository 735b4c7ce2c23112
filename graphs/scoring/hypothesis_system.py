# SPDX-License-Identifier: BSD-3-Clause
"""The Hessian on base parameters and hypotheses with all states eliminated: one elimination for all of them.

Regressors of hypotheses are further columns beside the shared values. With A = L L' for the states,

    H = C - W' W,   g = g_p - W' w,   W = L^-1 B,   w = L^-1 g_x

on (shared values, hypotheses). Nothing is solved anew for a hypothesis, and what the columns do to the states is there
for some ticks at a time only.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.score_system import ScoreRows, Segment
from jointscope.graphs.solving.banded_solver import Elimination

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HypothesisSystem:
    """Reduced system of one segment on its shared values (p of them) and k sizes of hypotheses.

    Attributes:
        H: Hessian, shape (p + k, p + k).
        g: gradient, shape (p + k,).
        W: L^-1 B of the hypotheses, shape (m d, k); empty where it was not kept.
    """

    H: Array
    g: Array
    W: Array


def hypothesis_system(segment: Segment, rows: Iterable[ScoreRows], k: int, keep: bool = True) -> HypothesisSystem:
    """Eliminates the states from the hypotheses' columns.

    Args:
        segment: the recording.
        rows: as `rows_in_time` gives them: pieces that begin earlier first.
        k: number of columns.
        keep: whether L^-1 B is wanted.
    """
    base = segment.elimination
    p, border, columns = base.W.shape[1], _Border(base, k, keep), segment.calibration.columns
    C_pk, C_kk, g_k = np.zeros((p, k)), np.zeros((k, k)), np.zeros(k)
    for part in rows:
        flat = part.by_size.reshape(-1, k)
        C_kk += flat.T @ flat
        twice = part.by_size * part.weights[:, :, None]
        weighted = twice.reshape(-1, k)
        g_k += weighted.T @ part.linear.residual.ravel()
        for block, J in part.linear.by_block.items():
            C_pk[columns[block]] += J.reshape(len(flat), J.shape[2]).T @ weighted
        border.add(part.linear.by_state, twice, part.ticks)
    border.solve(len(base.columns))
    C_pk -= border.with_base[:-1]
    H = np.block([[base.S, C_pk], [C_pk.T, C_kk - border.square]])
    return HypothesisSystem(H, np.concatenate([base.s, g_k - border.with_base[-1]]), border.kept)


class _Border:
    """The border of the states under the columns of hypotheses, of which only a window of ticks exists at a time.

    Args:
        base: the factorised chain.
        k: number of columns.
        keep: whether all of L^-1 B is kept.

    Attributes:
        square: W' W of what has been solved, shape (k, k).
        with_base: the chain's own W' W and w' W, shape (p + 1, k).
        kept: W, shape (m d, k), or nothing.
    """

    def __init__(self, base: Elimination, k: int, keep: bool):
        m, self._d = len(base.columns), base.d
        self._base, self._k, self._keep, self._start = base, k, keep, 0
        self._window = np.zeros((0, base.d, k))
        self._before = np.zeros((base.d, k))
        self.square, self.with_base = np.zeros((k, k)), np.zeros((base.W.shape[1] + 1, k))
        self.kept = np.zeros((m * base.d if keep else 0, k))

    def add(self, by_state: Sequence[Array], Z: Array, ticks: NDArray[np.intp]) -> None:
        """Adds samples; later ones begin nowhere before the first tick of these."""
        from jointscope.graphs.kernels.score_kernel import add_border  # numba takes half a second to import

        if len(ticks) == 0:
            return
        self.solve(int(ticks.min()))
        self._reach(int(ticks.max()) + len(by_state))
        for i, J in enumerate(by_state):
            add_border(np.ascontiguousarray(J), Z, np.asarray(ticks + (i - self._start), dtype=np.intp), self._window)

    def solve(self, until: int) -> None:
        """Solves for all ticks before one, to which nothing will be added."""
        from jointscope.graphs.kernels.score_kernel import solve_forth_columns  # as above

        count = until - self._start
        if count <= 0:
            return
        self._reach(until)
        W, base = self._window[:count], self._base
        solve_forth_columns(base.columns, self._start, self._before, W)
        rows = slice(self._start * self._d, (self._start + count) * self._d)
        flat = W.reshape(-1, self._k)
        self.square += flat.T @ flat
        self.with_base[:-1] += base.W[rows].T @ flat
        self.with_base[-1] += base.w[rows] @ flat
        if self._keep:
            self.kept[rows] = flat
        self._before, self._window = W[-1].copy(), self._window[count:].copy()
        self._start += count

    def _reach(self, end: int) -> None:
        """Widens the window up to a tick."""
        missing = end - self._start - len(self._window)
        if missing > 0:
            self._window = np.concatenate([self._window, np.zeros((missing, self._d, self._k))])
