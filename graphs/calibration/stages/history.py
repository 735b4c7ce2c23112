# SPDX-License-Identifier: BSD-3-Clause
"""How all stages of a calibration came down."""

from __future__ import annotations

from dataclasses import dataclass, field

from jointscope.graphs.solving.batch_solver import Solution


@dataclass(frozen=True)
class IterationRecord:
    """One iteration for the convergence plot: stage ("windows", "whole"), cost, damping, largest step [sigma]."""

    stage: str
    cost: float
    damping: float
    step_in_sigmas: float


@dataclass
class History:
    """Iterations of all stages."""

    records: list[IterationRecord] = field(default_factory=list)

    def add(self, stage: str, solution: Solution) -> None:
        """Takes in the iterations of one solve."""
        self.records += [IterationRecord(stage, i.cost_after, i.damping, i.step_in_sigmas) for i in solution.iterations]
