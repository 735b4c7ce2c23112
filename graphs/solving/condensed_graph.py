# SPDX-License-Identifier: BSD-3-Clause
"""All recordings as one `gtsam.NonlinearFactorGraph` with its `gtsam.Values`.

    X(0) ==== X(a) ==== X(b) ==== ...      ====  a condensed factor: hundreds of samples
       |       |  |       |
       +--- D, R(imu1), B(imu1), ... ---- P

Every condensed factor touches the shared blocks, too; P are priors and biases, a factor each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import gtsam
import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.condensed import CondensedFactor
from jointscope.factors.single import (
    block_key,
    extract_calibration,
    insert_calibration,
    stacked_factor,
    state_key,
)
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.set_problem import Problem, motions, owners, priors_of
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.graphs.solving.solver_context import side_by_side
from jointscope.graphs.solving.stretch import Elsewhere, GraphStretch, Place, cut
from jointscope.graphs.solving.whole_set import WholeSet

Array = NDArray[np.float64]

STRETCH = 1000  # steps: as many as are linearised at once
MOST_STRETCHES = 100  # GTSAM copies all values for every callback: time grows with the square of their number


@dataclass(frozen=True)
class CondensedGraph:
    """The graph of some recordings.

    Attributes:
        problems: the recordings, or pieces of them.
        graph: condensed factors, and one factor for each prior and bias.
        stretches: of each piece, in the order of time; of another kind than motion the one that holds everything.
        blocks: names of the blocks that may change, of each piece.
        shared: where the shared values stand in one vector.
        likes: calibration of each piece, for the blocks that are held.
        held_cost: cost of priors whose block is held.
        elsewhere: who keeps the recordings of motion, if not this process.
    """

    problems: tuple[Problem, ...]
    graph: gtsam.NonlinearFactorGraph
    stretches: tuple[tuple[GraphStretch, ...], ...]
    blocks: tuple[tuple[str, ...], ...]
    shared: SharedLayout
    likes: tuple[Calibration, ...]
    held_cost: float
    elsewhere: Elsewhere | None = None

    @staticmethod
    def of(
        problems: Sequence[Problem],
        start: Estimate,
        hold: Sequence[str] = (),
        length: int = 0,
        elsewhere: Elsewhere | None = None,
    ) -> tuple[CondensedGraph, gtsam.Values]:
        """The graph, and the values of an estimate.

        Args:
            problems: recordings of any kinds, all of one robot.
            start: where it is linearised first.
            hold: blocks that stay as they are; they are no variables of the graph.
            length: steps in one stretch; chosen by the number of samples if 0.
            elsewhere: takes the recordings of motion, which stand first.
        """
        places = owners(problems)
        length = length or max(STRETCH, sum(len(p.dynamics) for p in motions(problems)) // MOST_STRETCHES)
        # nothing is no variable: a robot may have no free parameter
        free = [like.free(hold) for like in start.calibrations]
        values = gtsam.Values()
        for like, blocks, owner in zip(start.calibrations, free, places, strict=True):
            insert_calibration(values, like, owner, blocks)
        likes = tuple(
            extract_calibration(values, calibration, blocks, owner)
            for calibration, blocks, owner in zip(start.calibrations, free, places, strict=True)
        )
        graph, stretches = gtsam.NonlinearFactorGraph(), []
        for piece, (problem, x, like) in enumerate(zip(problems, start.states, likes, strict=True)):
            blocks = free[piece]
            cuts: tuple[GraphStretch, ...]
            if isinstance(problem, BagProblem):
                cuts = tuple((elsewhere.cut if elsewhere else cut)(problem, x, like, length, blocks))
            else:
                cuts = (WholeSet(problem, x, like, blocks),)
            for stretch in cuts:
                graph.add(CondensedFactor(stretch, piece, places[piece], blocks, like).factor())
            for tick in _between(cuts):
                values.insert(state_key(tick, piece), x[tick])
            stretches.append(cuts)
        held = _add_rows_without_states(graph, problems, places, likes, free)
        shared = SharedLayout.of(start.calibrations, places)
        return CondensedGraph(
            tuple(problems), graph, tuple(stretches), tuple(free), shared, likes, held, elsewhere
        ), values

    def cost(self, values: gtsam.Values) -> float:
        """Half the sum of squared whitened residuals, priors of held blocks included."""
        if self.elsewhere:
            self.elsewhere.visit(self._places(values))
        else:
            self._visit_side_by_side(values)
        return float(self.graph.error(values)) + self.held_cost

    @property
    def costs(self) -> list[Array]:
        """Cost of each tick of each piece where it was evaluated last, shape (m,)."""
        return [_overlapped([stretch.costs for stretch in cuts]) for cuts in self.stretches]

    def expect(self, damping: float, bends: Sequence[Array]) -> None:
        """Says how states will be damped where the next point is accepted; arguments as of `linearized`."""
        for piece, cuts in enumerate(self.stretches):
            if isinstance(self.problems[piece], BagProblem):
                for stretch in cuts:
                    stretch.damp(damping, bends[piece])

    def linearized(
        self, values: gtsam.Values, damping: float = 0.0, bends: Sequence[Array] = ()
    ) -> gtsam.GaussianFactorGraph:
        """The Gaussian graph at some values.

        Args:
            values: where it is linearised.
            damping: of all states, relative to the diagonal of their Hessian.
            bends: larger ones for some states of each piece, shape (m,).
        """
        for piece, cuts in enumerate(self.stretches):
            for stretch in cuts:
                stretch.damp(damping, bends[piece] if len(bends) else None)
        if self.elsewhere:
            self.elsewhere.linearise(self._places(values), damping, bends)
        else:
            self._visit_side_by_side(values, settle=True)
        return self.graph.linearize(values)

    def _visit_side_by_side(self, values: gtsam.Values, settle: bool = False) -> None:
        """Brings all stretches where GTSAM will ask for them, one after the other; they remember what they found."""

        def visit(task: tuple[GraphStretch, tuple[Array, ...], Calibration]) -> None:
            stretch, ends, calibration = task
            stretch.visit(ends, calibration)
            if settle:
                stretch.settle()

        motions = [cuts for cuts, p in zip(self.stretches, self.problems, strict=True) if isinstance(p, BagProblem)]
        places = zip(motions, self._places(values), strict=True)
        tasks = [(s, ends, at.calibration) for cuts, at in places for s, ends in zip(cuts, at.ends, strict=True)]
        for _ in side_by_side(visit, tasks):
            pass

    def _places(self, values: gtsam.Values) -> list[Place]:
        """Where each recording of motion is, at some values."""
        found = []
        for piece, cuts in enumerate(self.stretches):
            if isinstance(self.problems[piece], BagProblem):
                ends = [tuple(values.atVector(state_key(tick, piece)) for tick in s.ticks) for s in cuts]
                owner = self.shared.owners[piece]
                found.append(
                    Place(tuple(ends), extract_calibration(values, self.likes[piece], self.blocks[piece], owner))
                )
        return found

    @property
    def dynamics_key(self) -> int | None:
        """Key of the dynamic parameters; None where they are held or there are none."""
        return block_key(DYNAMICS, self.likes[0]) if DYNAMICS in self.blocks[0] else None

    @property
    def states_ordering(self) -> gtsam.Ordering:
        """The states between stretches, piece after piece."""
        ordering = gtsam.Ordering()
        for piece, cuts in enumerate(self.stretches):
            for tick in _between(cuts):
                ordering.push_back(state_key(tick, piece))
        return ordering

    @property
    def shared_ordering(self) -> gtsam.Ordering:
        """All shared blocks that may change."""
        ordering = gtsam.Ordering()
        for key, _ in self.shared_keys:
            ordering.push_back(key)
        return ordering

    @property
    def shared_keys(self) -> list[tuple[int, NDArray[np.intp]]]:
        """Keys of all shared blocks that may change, with their places in the vector of all shared values."""
        found: dict[int, NDArray[np.intp]] = {}
        for piece, owner in enumerate(self.shared.owners):
            for block in self.blocks[piece]:
                place = self.shared.places[piece][block]
                found[block_key(block, self.likes[piece], owner)] = np.arange(place.start, place.stop)
        return list(found.items())

    def estimate(self, values: gtsam.Values) -> Estimate:
        """All states and shared values where the graph was evaluated last, which must be at these values."""
        calibrations = tuple(
            extract_calibration(values, like, blocks, owner)
            for like, blocks, owner in zip(self.likes, self.blocks, self.shared.owners, strict=True)
        )
        if self.elsewhere:
            self.elsewhere.fetch_states(self._places(values))
        states = tuple(
            np.vstack([cuts[0].states, *(stretch.states[1:] for stretch in cuts[1:])]) for cuts in self.stretches
        )
        return Estimate(states, calibrations)


def _between(cuts: Sequence[GraphStretch]) -> list[int]:
    """Ticks at the ends of stretches."""
    return list(dict.fromkeys(tick for stretch in cuts for tick in stretch.ticks))


def _add_rows_without_states(
    graph: gtsam.NonlinearFactorGraph,
    problems: Sequence[Problem],
    owners: Sequence[int],
    likes: Sequence[Calibration],
    free: Sequence[Sequence[str]],
) -> float:
    """Adds priors and what else touches no state; returns the cost of those whose block is held."""
    alone = list(priors_of(problems, likes))
    for piece, problem in enumerate(problems):
        if isinstance(problem, BagProblem):
            alone += [(placed.factor, piece) for placed in problem.placed if placed.factor.states == 0]
    held = 0.0
    for factor, piece in alone:
        if set(factor.blocks) <= set(free[piece]):
            graph.add(stacked_factor(factor, likes[piece], owners[piece]))
        else:
            residual = factor.residual((), likes[piece]) / factor.sigmas
            held += 0.5 * float(np.sum(residual**2))
    return held


def _overlapped(parts: Sequence[Array]) -> Array:
    """Arrays one after the other; the last entry of each is the first one of the next."""
    joined = np.concatenate([parts[0], *(part[1:] for part in parts[1:])])
    place = 0
    for before, after in pairwise(parts):
        place += len(before) - 1
        joined[place] = before[-1] + after[0]
    return joined
