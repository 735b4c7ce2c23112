# SPDX-License-Identifier: BSD-3-Clause
"""What it costs to have GTSAM solve: iterations of the condensed graph against the band factorised alone."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.batch_solver import Solution, newton_step
from jointscope.graphs.solving.condensed_graph import CondensedGraph
from jointscope.graphs.solving.damped_step import damped_step
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.normal_equations import build
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.graphs.solving.solver_context import in_solver_context

ROUNDS = 7  # iterations of each kind, in turn


@dataclass(frozen=True)
class GraphOverhead:
    """CPU seconds of one iteration: linearised, eliminated, stepped, with the cost at the end.

    Attributes:
        ticks: number of states.
        factors: of the condensed graph.
        band: by one banded factorisation of all states, without GTSAM.
        graph: by GTSAM over condensed factors.
        difference: largest difference of the shared values where both end, in sigmas.
    """

    ticks: int
    factors: int
    band: float
    graph: float
    difference: float


@in_solver_context
def graph_overhead(problem: BagProblem, estimate: Estimate) -> GraphOverhead:
    """Iterates both ways from an estimate near the minimum, in turn, and takes the shortest of each."""
    layout = SharedLayout.of(estimate.calibrations, (0,))
    graph, values = CondensedGraph.of([problem], estimate)
    graph.cost(values)
    band, system = estimate, build(problem, estimate.states[0], estimate.calibrations[0])
    seconds: tuple[list[float], list[float]] = ([], [])

    def by_band() -> None:
        nonlocal band, system
        band = newton_step([problem], Solution(band, system.cost, layout, [system])).estimate
        system = build(problem, band.states[0], band.calibrations[0])

    def by_graph() -> None:
        nonlocal values
        values = damped_step(graph, values, 0.0).values
        graph.cost(values)

    for _ in range(ROUNDS):
        for times, iterate in zip(seconds, (by_band, by_graph), strict=True):
            times.append(_cpu(iterate))
    ours, theirs = (min(times) for times in seconds)
    ends = (e.calibrations[0].dynamics for e in (band, graph.estimate(values)))
    sigmas = np.sqrt(1.0 / np.diag(system.C)[: band.calibrations[0].dynamics.size])
    apart = float(np.max(np.abs(np.subtract(*ends)) / sigmas))
    return GraphOverhead(len(estimate.states[0]), graph.graph.size(), ours, theirs, apart)


def _cpu(work: Callable[[], None]) -> float:
    started = time.process_time()
    work()
    return time.process_time() - started
