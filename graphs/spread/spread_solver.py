# SPDX-License-Identifier: BSD-3-Clause
"""The batch solver with its recordings on workers: a map over recordings, and the sum that GTSAM makes of it."""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.batch_solver import Progress, Solution, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.set_problem import Problem, motions
from jointscope.graphs.solving.stretch import Place
from jointscope.graphs.spread.distant_stretch import DistantStretch
from jointscope.graphs.spread.kept_recording import Beginning, States
from jointscope.graphs.spread.spread_recording import SpreadRecording
from jointscope.graphs.workers.crew import Crew

Array = NDArray[np.float64]


@dataclass
class SpreadSolver:
    """Takes the place of `batch_solver.solve`, with the same result but for rounding.

    Recordings are spread when there are at least two; pieces of another kind than motion stay here, as they are small.

    Attributes:
        crew: the workers.
        client: who asks, for workers that serve several.
        solves: so far.
    """

    crew: Crew
    client: str = field(default_factory=lambda: uuid.uuid4().hex)
    solves: int = 0

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
        self.solves += 1
        pieces = motions(problems)
        if len(pieces) < 2 or self.crew.slots < 2:
            return solve(problems, start, max_iterations=max_iterations, hold=hold, progress=progress)
        slots = spread_evenly([len(problem.dynamics) for problem in pieces], self.crew.slots)
        spread = _Spread(self.crew, (self.client, self.solves), slots)
        solution = solve(problems, start, max_iterations=max_iterations, hold=hold, progress=progress, elsewhere=spread)
        spread.forget()
        return solution


@dataclass
class _Spread:
    """The recordings of one solve (`Elsewhere`); those of motion stand first."""

    crew: Crew
    name: tuple[str, int]
    slots: Sequence[int]
    recordings: list[SpreadRecording] = field(default_factory=list)

    def cut(
        self, problem: BagProblem, x: Array, calibration: Calibration, length: int, blocks: Sequence[str]
    ) -> tuple[DistantStretch, ...]:
        """Arguments as of `cut`; the next piece goes to the worker of its slot."""
        piece = len(self.recordings)
        beginning = Beginning(problem, x, calibration, length, tuple(blocks))
        self.recordings.append(SpreadRecording(self.crew, self.slots[piece], (*self.name, piece), beginning))
        return self.recordings[-1].stretches

    def visit(self, places: Sequence[Place]) -> None:
        """All workers evaluate at once."""
        for recording, place in zip(self.recordings, places, strict=True):
            recording.visit(place)
        self._heard()

    def linearise(self, places: Sequence[Place], damping: float, bends: Sequence[Array]) -> None:
        """All workers linearise and eliminate at once."""
        for i, (recording, place) in enumerate(zip(self.recordings, places, strict=True)):
            recording.linearise(place, damping, bends[i].copy() if len(bends) and np.any(bends[i]) else None)
        self._heard()

    def fetch_states(self, places: Sequence[Place]) -> None:
        """All workers send their states."""
        for recording, place in zip(self.recordings, places, strict=True):
            recording.ask(States(place))
        self._heard()

    def forget(self) -> None:
        """Workers need their recordings no longer; where a solve failed, its client's next one makes them forget."""
        for recording in self.recordings:
            recording.forget()

    def _heard(self) -> None:
        for recording in self.recordings:
            recording.heard()


def spread_evenly(sizes: Sequence[int], slots: int) -> list[int]:
    """Slot of each recording: the longest first, each to where least is."""
    load, found = np.zeros(slots), [0] * len(sizes)
    for i in np.argsort(-np.asarray(sizes), kind="stable").tolist():
        found[i] = int(np.argmin(load))
        load[found[i]] += sizes[i]
    return found
