# SPDX-License-Identifier: BSD-3-Clause
"""iSAM2 over condensed factors: a calibration that knows more after every stretch of motion.

A stretch enters with its end state. iSAM2 relinearises what has moved by more than a tenth of its sigma since it was
linearised, shared values with all stretches that see them; states inside stretches follow as in the batch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import gtsam
import numpy as np
from numpy.typing import NDArray

from jointscope.factors.block import VECTOR, BlockKind
from jointscope.factors.calibration import Calibration
from jointscope.factors.single import extract_calibration
from jointscope.graphs.solving.batch_solver import Progress, Solution, solve
from jointscope.graphs.solving.condensed_graph import MOST_STRETCHES, STRETCH, CondensedGraph
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.set_problem import Problem, motions, motions_only
from jointscope.robots.errors import SolveError
from jointscope.robots.outside_modules import need_module
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

MOVED = 0.1  # [sigma] from its linearisation point at which a variable is linearised anew
FEWEST, SHORTEST = 8, 100  # stretches of a recording, and steps in one
MOST_UPDATES = 6  # of one stretch; where dry friction keeps values jumping, the stretches to come may settle them


@dataclass(frozen=True)
class KnownSoFar:
    """What is known after a stretch.

    Attributes:
        recording: that the stretch is from.
        seconds: how much of it has been seen [s].
        stretch, stretches: number of stretches so far, and of all.
        calibration: shared values.
        sigmas: standard deviations of the free dynamic parameters in their units, shape (p,).
    """

    recording: Recording
    seconds: float
    stretch: int
    stretches: int
    calibration: Calibration
    sigmas: Array


@dataclass
class Incremental:
    """Takes the place of `batch_solver.solve`: iSAM2 first, then the steps that the batch's end still asks for.

    Where the noise is found to be another when all samples are in, the batch goes on from where iSAM2 ended.

    Attributes:
        told: called after every stretch.
        gave_up: called with a sentence where iSAM2 cannot go on; the batch then begins at the start values.
        done: whether the stretches were gone through.
    """

    told: Callable[[KnownSoFar], None]
    gave_up: Callable[[str], None] = lambda text: None
    done: bool = False

    def __call__(
        self,
        problems: Sequence[Problem],
        start: Estimate,
        *,
        max_iterations: int,
        hold: Sequence[str],
        progress: Progress | None,
    ) -> Solution:
        """Arguments and result as of `solve`."""
        if self.done:
            return solve(problems, start, max_iterations=max_iterations, hold=hold, progress=progress)
        self.done = True
        steps = [len(problem.dynamics) for problem in motions_only(problems, "`--incremental`")]
        length = max(min(max(max(steps) // FEWEST, SHORTEST), STRETCH), sum(steps) // MOST_STRETCHES)
        return solve(
            problems,
            start,
            max_iterations=max_iterations,
            hold=hold,
            progress=progress,
            first=self._first,
            length=length,
        )

    def _first(self, graph: CondensedGraph, values: gtsam.Values) -> gtsam.Values | None:
        """Where iSAM2 ends; None where it ran away."""
        try:
            return incrementally(graph, values, self.told)
        except SolveError as err:
            self.gave_up(str(err))
            return None


def incrementally(graph: CondensedGraph, values: gtsam.Values, told: Callable[[KnownSoFar], None]) -> gtsam.Values:
    """Where iSAM2 ends after all stretches, one after the other.

    Args:
        graph: of whole recordings.
        values: start values of all variables.
        told: called after every stretch.

    Raises:
        SolveError: a variable that the stretches so far do not determine.
    """
    need_module("gtsam")
    parameters = gtsam.ISAM2Params()
    parameters.setFactorization("QR")
    parameters.relinearizeSkip = 1
    parameters.setRelinearizeThreshold(0.0)  # who stays is said at every update
    smoother = gtsam.ISAM2(parameters)
    seen, stretches, kinds = list[int](), sum(map(len, graph.stretches)), _kinds(graph)
    for number, (bag, tick, added) in enumerate(_portions(graph)):
        new = gtsam.Values()
        for i in range(added.size()):
            for key in added.at(i).keys():
                if key not in seen:
                    seen.append(key)
                    kind = kinds.get(key, VECTOR)
                    new.insert(key, kind.to_gtsam(kind.from_gtsam(values, key)))
        try:
            _settle(smoother, added, new, seen)
            calibration, sigmas = _shared(graph, smoother, bag)
            problem = motions(graph.problems)[bag]
            recording, ticks = problem.recording, problem.timeline.ticks
            seconds = float(ticks[tick] - ticks[0])
            told(KnownSoFar(recording, seconds, number + 1, stretches, calibration, sigmas))
        except (RuntimeError, SolveError) as err:
            raise SolveError(
                f"iSAM2 runs away at stretch {number + 1} of {stretches}: start values may be far off, or the model "
                "contradicts the recording; all stretches are solved together instead"
            ) from err
    return smoother.calculateBestEstimate()


def _portions(graph: CondensedGraph) -> Iterator[tuple[int, int, gtsam.NonlinearFactorGraph]]:
    """Recording, last tick and factors of each stretch, with those that touch no state as soon as they can be."""
    place, seen = 0, set[int]()
    waiting = [graph.graph.at(i) for i in range(sum(map(len, graph.stretches)), graph.graph.size())]
    for bag, cuts in enumerate(graph.stretches):
        for stretch in cuts:
            portion = gtsam.NonlinearFactorGraph()
            portion.add(graph.graph.at(place))
            seen.update(graph.graph.at(place).keys())
            place += 1
            for factor in [factor for factor in waiting if seen.issuperset(factor.keys())]:
                portion.add(factor)
                waiting.remove(factor)
            yield bag, stretch.ticks[1], portion


def _settle(smoother: gtsam.ISAM2, added: gtsam.NonlinearFactorGraph, new: gtsam.Values, keys: list[int]) -> None:
    """Takes factors in and relinearises until nothing is far from where it was linearised."""
    smoother.update(added, new, noRelinKeys=_list(keys))
    for _ in range(MOST_UPDATES):
        delta = smoother.getDelta()
        near = [key for key in keys if _in_sigmas(smoother, key, delta.at(key)) < MOVED]
        if len(near) == len(keys):
            return
        smoother.update(gtsam.NonlinearFactorGraph(), gtsam.Values(), noRelinKeys=_list(near), force_relinearize=True)


def _in_sigmas(smoother: gtsam.ISAM2, key: int, change: Array) -> float:
    """Largest part of a change in sigmas."""
    return float(np.max(np.abs(change) / np.sqrt(np.maximum(np.diag(smoother.marginalCovariance(key)), 1e-300))))


def _shared(graph: CondensedGraph, smoother: gtsam.ISAM2, bag: int) -> tuple[Calibration, Array]:
    """Shared values with the biases of a recording, and sigmas of the dynamic parameters in their units."""
    found = extract_calibration(smoother.calculateEstimate(), graph.likes[bag], graph.blocks[bag], bag)
    if graph.dynamics_key is None:
        return found, np.zeros(len(found.names))
    return found, np.sqrt(np.diag(smoother.marginalCovariance(graph.dynamics_key))) * found.value_by_coordinate


def _list(keys: list[int]) -> gtsam.KeyList:
    found = gtsam.KeyList()
    for key in keys:
        found.push_back(key)
    return found


def _kinds(graph: CondensedGraph) -> dict[int, BlockKind]:
    """Kind of each block by its key; all others are states."""
    pieces = zip(graph.likes, graph.shared.owners, strict=True)
    return {block.key(owner): block.kind for like, owner in pieces for block in like.layout.values()}
