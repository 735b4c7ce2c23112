# SPDX-License-Identifier: BSD-3-Clause
"""A stretch of one recording: its normal equations, with all states but those at its ends eliminated.

[ A  B ] [inner]      B: inner states against (first, last, free blocks), C: those among themselves
[ B' C ] [ rim ]
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import Elimination, eliminate
from jointscope.graphs.solving.normal_equations import NormalEquations, build

Array = NDArray[np.float64]


@dataclass
class Point:
    """Where a stretch was evaluated.

    Attributes:
        x: all its states, shape (m, d).
        calibration: shared values.
        system: normal equations there, all blocks included.
    """

    x: Array
    calibration: Calibration
    system: NormalEquations

    def is_at(self, first: Array, last: Array, calibration: Calibration) -> bool:
        """Whether that is the same place, to the last digit."""
        return (
            np.array_equal(self.x[0], first)
            and np.array_equal(self.x[-1], last)
            and self.calibration.is_at(calibration)
        )


class RecordingStretch:
    """Samples of one recording between two ticks.

    Args:
        problem: the factors of these samples alone, ticks counted from the first.
        x: states to begin with, shape (m, d), m >= 2.
        calibration: shared values to begin with.
        start: tick of the first state in its recording.
        blocks: names of the blocks that may change.

    Attributes:
        damping: Levenberg-Marquardt lambda of each state, relative to the diagonal, shape (m,).
    """

    def __init__(self, problem: BagProblem, x: Array, calibration: Calibration, start: int, blocks: Sequence[str]):
        self.problem, self._start = problem, start
        self.damping = np.zeros(len(x))
        self._d = x.shape[1]
        own = calibration.columns
        self._kept = np.concatenate([np.arange(own[b].start, own[b].stop) for b in blocks] or [np.zeros(0, int)])
        self._columns: dict[str, slice] = {}
        n = 2 * self._d
        for block in blocks:
            self._columns[block] = slice(n, n + calibration.block_size(block))
            n += calibration.block_size(block)
        self._size = n
        self._base = self._trial = self._evaluated(x.copy(), calibration)
        self._elimination: Elimination | None = None
        self._eliminated_with = self.damping

    @property
    def ticks(self) -> tuple[int, int]:
        """First and last tick in the recording."""
        return self._start, self._start + len(self._base.x) - 1

    @property
    def size(self) -> int:
        """Number of columns: both ends, then the free blocks."""
        return self._size

    @property
    def states(self) -> Array:
        """All states at the last evaluated point, shape (m, d)."""
        return self._trial.x

    @property
    def system(self) -> NormalEquations:
        """Normal equations at the last evaluated point."""
        return self._trial.system

    def columns(self, block: str) -> slice:
        """Columns of a free block."""
        return self._columns[block]

    def damp(self, damping: float, bends: Array | None) -> None:
        """Sets the damping of all states, larger where `bends` says so, of all states of the recording."""
        first, last = self.ticks
        own = np.zeros(len(self.damping)) if bends is None else bends[first : last + 1]
        self.damping = np.maximum(own, damping)

    def visit(self, ends: Sequence[Array], calibration: Calibration) -> float:
        """Evaluates everything at new ends and shared values; returns the cost there."""
        first, last = ends
        if self._base.is_at(first, last, calibration):
            self._trial = self._base
        elif not self._trial.is_at(first, last, calibration):
            self._trial = self._evaluated(self._following(first, last, calibration), calibration)
        return self._trial.system.cost

    def settle(self) -> tuple[Array, Array, float]:
        """Makes the visited point the linearisation point: H, shape (n, n), g, shape (n,), and the cost left."""
        same = self._elimination is not None and np.array_equal(self._eliminated_with, self.damping)
        if self._base is not self._trial or not same:
            self._base = self._trial
            self._elimination, self._eliminated_with = self._eliminated(), self.damping
        found = self._elimination
        system = self._base.system
        if found is None:
            rim = self._rim(system)
            return rim.C, rim.g_p, system.cost
        return found.S, found.s, system.cost - 0.5 * float(found.w @ found.w)

    def _evaluated(self, x: Array, calibration: Calibration) -> Point:
        return Point(x, calibration, build(self.problem, x, calibration))

    def _eliminated(self) -> Elimination | None:
        """The inner states eliminated; None where there are none."""
        system = self._base.system
        return eliminate(self._rim(system), self.damping[1:-1], self._start + 1) if len(system.D) > 2 else None

    def _rim(self, system: NormalEquations) -> NormalEquations:
        """The system with both ends counted among the shared values, held blocks left out."""
        d, kept, n = self._d, self._kept, self._size
        first, last, blocks = slice(0, d), slice(d, 2 * d), slice(2 * d, n)
        B = np.zeros((len(system.D) - 2, d, n))
        C = np.zeros((n, n))
        if len(B):
            B[0, :, first], B[-1, :, last] = system.E[0], system.E[-1].T
            B[:, :, blocks] = system.B[1:-1][:, :, kept]
        else:
            C[last, first], C[first, last] = system.E[0], system.E[0].T
        for end, k in ((first, 0), (last, -1)):
            C[end, end] = system.D[k] + self.damping[k] * np.diag(np.diag(system.D[k]))
            C[end, blocks], C[blocks, end] = system.B[k][:, kept], system.B[k][:, kept].T
        C[blocks, blocks] = system.C[np.ix_(kept, kept)]
        g = np.concatenate([system.g_x[0], system.g_x[-1], system.g_p[kept]])
        return NormalEquations(
            system.D[1:-1], system.E[1:-1], B, C, system.g_x[1:-1], g, system.cost, system.costs[1:-1]
        )

    def _following(self, first: Array, last: Array, calibration: Calibration) -> Array:
        """All states, the inner ones where the last linearisation puts them for new ends and shared values."""
        base = self._base
        x = base.x.copy()
        x[0], x[-1] = first, last
        if len(x) > 2:
            if self._elimination is None:
                self._elimination, self._eliminated_with = self._eliminated(), self.damping
            assert self._elimination is not None
            parts = [first - base.x[0], last - base.x[-1]]
            parts += [base.calibration.local(calibration, block) for block in self._columns]
            x[1:-1] += self._elimination.states(np.concatenate(parts))
        return x


def cut(
    problem: BagProblem, x: Array, calibration: Calibration, length: int, blocks: Sequence[str]
) -> Iterator[RecordingStretch]:
    """A recording in stretches of about `length` steps, side by side.

    Args:
        problem: all its factors.
        x: states, shape (m + 1, d).
        calibration: shared values.
        length: steps in one stretch.
        blocks: names of the blocks that may change.
    """
    steps = len(problem.dynamics)
    edges = np.linspace(0, steps, max(round(steps / length), 1) + 1).round().astype(int)
    for a, b in pairwise(edges.tolist()):
        placed = []
        for p in problem.placed:
            if p.factor.states == 0:
                continue
            inside = (p.ticks >= a) & ((p.ticks < b) | (b == steps))
            chosen = np.flatnonzero(inside)
            if len(chosen):
                placed.append(replace(p, factor=p.factor.select(chosen), ticks=p.ticks[chosen] - a))
        part = replace(problem, dynamics=problem.dynamics.select(slice(a, b)), placed=tuple(placed))
        yield RecordingStretch(part, x[a : b + 1], calibration, a, blocks)
