# SPDX-License-Identifier: BSD-3-Clause
"""In a worker: the stretches of a recording between two questions about them.

What a worker keeps follows from how the recording began and the linearisations since, which whoever asks has written
down. So a worker that lacks it, because it is new or has been restarted, is told both and comes to the same place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.graphs.solving.stretch import Place, RecordingStretch, cut

Array = NDArray[np.float64]
Key = tuple[str, int, int]
"""Who asks, the number of the solve, the piece."""


@dataclass(frozen=True)
class Beginning:
    """A recording and where its solve begins; arguments of `cut`."""

    problem: BagProblem
    x: Array
    calibration: Calibration
    length: int
    blocks: tuple[str, ...]


class Question(Protocol):
    """What is asked about a kept recording."""

    def answer(self, kept: Kept) -> Any:
        """What a stretch after the other says."""


@dataclass
class Kept:
    """Stretches of a recording, and how many linearisations they have seen."""

    stretches: list[RecordingStretch]
    serial: int = 0


@dataclass(frozen=True)
class Visit:
    """Cost at a place, of each stretch; and of each of its ticks."""

    place: Place

    def answer(self, kept: Kept) -> list[tuple[float, Array]]:
        """Cost and costs of each stretch."""
        return [(cost, s.costs) for cost, s in zip(visited(kept, self.place), kept.stretches, strict=True)]


@dataclass(frozen=True)
class Linearisation:
    """A place from which the inner states follow next, with the damping of all states and of some, shape (m,)."""

    serial: int
    place: Place
    damping: float
    bends: Array | None

    def answer(self, kept: Kept) -> list[tuple[float, Array, Array, Array, float]]:
        """Cost, costs, and what is left on the rim, H, g and the cost, of each stretch."""
        kept.serial = -1  # neither the one nor the other, should it fail
        for stretch in kept.stretches:
            stretch.damp(self.damping, self.bends)
        costs = visited(kept, self.place)
        rims = [stretch.settle() for stretch in kept.stretches]
        kept.serial = self.serial
        return [(cost, s.costs, *rim) for cost, s, rim in zip(costs, kept.stretches, rims, strict=True)]


@dataclass(frozen=True)
class States:
    """All states at a place."""

    place: Place

    def answer(self, kept: Kept) -> list[Array]:
        """Of each stretch, shape (m, d)."""
        visited(kept, self.place)
        return [stretch.states for stretch in kept.stretches]


_kept: dict[Key, Kept] = {}


def visited(kept: Kept, place: Place) -> list[float]:
    """Brings all stretches to a place; their costs there."""
    pairs = zip(kept.stretches, place.ends, strict=True)
    return [stretch.visit(ends, place.calibration) for stretch, ends in pairs]


@in_solver_context
def ask(key: Key, serial: int, question: Question) -> Any:
    """The answer; None where this worker does not keep the recording as it is after `serial` linearisations."""
    kept = _kept.get(key)
    return None if kept is None or kept.serial != serial else question.answer(kept)


@in_solver_context
def told_and_asked(key: Key, beginning: Beginning, log: Sequence[Linearisation], question: Question) -> Any:
    """The answer of a worker that is told everything."""
    forget(key)
    parts = cut(beginning.problem, beginning.x, beginning.calibration, beginning.length, beginning.blocks)
    kept = Kept(list(parts))
    for step in log:
        step.answer(kept)
    _kept[key] = kept
    return question.answer(kept)


def forget(key: Key) -> None:
    """Drops the piece, and all that belongs to earlier solves of who asks."""
    for other in [k for k in list(_kept) if k[0] == key[0] and (k[1] != key[1] or k == key)]:
        _kept.pop(other, None)
