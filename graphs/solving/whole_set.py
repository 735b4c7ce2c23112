# SPDX-License-Identifier: BSD-3-Clause
"""A recording without a chain as one condensed factor: all its states are eliminated, only shared blocks are left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.solving.banded_solver import Elimination, eliminate
from jointscope.graphs.solving.inner_states import Point
from jointscope.graphs.solving.normal_equations import NormalEquations
from jointscope.graphs.solving.set_problem import SetProblem

Array = NDArray[np.float64]

MOST_STEPS = 10  # of the states alone
ARRIVED = 1e-12  # fall of the cost, relative or in absolute terms, that is rounding


@dataclass
class SetPoint(Point):
    """The same with the normal equations there."""

    system: NormalEquations


class WholeSet:
    """All samples of a recording of another kind than motion, as `RecordingStretch` those between two ticks.

    Args:
        problem: the recording.
        x: states to begin with, shape (m, d).
        calibration: the blocks that it touches.
        blocks: names of those that may change.

    Attributes:
        ticks: none; it has no ends.
        damping: Levenberg-Marquardt lambda of each state, relative to the diagonal, shape (m,).
    """

    ticks: tuple[int, ...] = ()

    def __init__(self, problem: SetProblem, x: Array, calibration: Calibration, blocks: Sequence[str]):
        self._problem, self.damping = problem, np.zeros(len(x))
        self._kept = np.concatenate(
            [np.arange(calibration.size)[calibration.columns[b]] for b in blocks] or [np.zeros(0, np.intp)]
        )
        self._free = calibration.only(blocks)
        self._base = self._trial = self._settled(x, calibration)
        self._elimination: Elimination | None = None

    @property
    def size(self) -> int:
        """Number of columns: the free blocks."""
        return self._free.size

    @property
    def states(self) -> Array:
        """All states at the last evaluated point, shape (m, d)."""
        return self._trial.x

    @property
    def system(self) -> NormalEquations:
        """Normal equations at the last evaluated point."""
        return self._trial.system

    @property
    def costs(self) -> Array:
        """Cost of each state there, shape (m,)."""
        return self._trial.costs

    def columns(self, block: str) -> slice:
        """Columns of a free block."""
        return self._free.columns[block]

    def damp(self, damping: float, bends: Array | None) -> None:
        """Sets the damping of all states, larger where `bends` says so, shape (m,)."""
        self.damping = np.maximum(0.0 if bends is None else bends, np.full(len(self.damping), damping))
        self._elimination = None

    def visit(self, ends: Sequence[Array], calibration: Calibration) -> float:
        """Evaluates everything at new shared values, the states following; returns the cost there."""
        if self._base.calibration.is_at(calibration):
            self._trial = self._base
        elif not self._trial.calibration.is_at(calibration):
            base = self._base
            step = [base.calibration.local(calibration, block) for block in self._free.blocks]
            x = base.x + self._eliminated().states(np.concatenate([*step, np.zeros(0)]))
            self._trial = self._settled(x, calibration)
        return self._trial.cost

    def settle(self) -> tuple[Array, Array, float]:
        """Makes the visited point the linearisation point: H, shape (n, n), g, shape (n,), and the cost left."""
        if self._base is not self._trial:
            self._base, self._elimination = self._trial, None
        found = self._eliminated()
        return found.S, found.s, self._base.cost - 0.5 * float(found.w @ found.w)

    def _settled(self, x: Array, calibration: Calibration) -> SetPoint:
        """The point to which the states go for given shared values, by Newton steps of the states alone.

        They cost little, and equations of rest bind states so tightly that linear steps of both would have to be short.
        """
        system = self._problem.linearize(x, calibration)
        for _ in range(MOST_STEPS if len(x) else 0):
            try:
                step = np.linalg.solve(system.D, -system.g_x[:, :, None])[:, :, 0]
            except np.linalg.LinAlgError:
                break  # a trial so far off that one term drowns the others: its cost turns it down
            if -0.5 * float(np.sum(step * system.g_x)) < ARRIVED * max(system.cost, 1.0):
                break
            there = self._problem.linearize(x + step, calibration)
            if not there.cost < system.cost:
                break
            x, system = x + step, there
        return SetPoint(x.copy(), calibration, system.cost, system.costs, system)

    def _eliminated(self) -> Elimination:
        if self._elimination is None:
            system, kept = self._base.system, self._kept
            free = replace(system, B=system.B[:, :, kept], C=system.C[np.ix_(kept, kept)], g_p=system.g_p[kept])
            self._elimination = eliminate(free, self.damping)
        return self._elimination
