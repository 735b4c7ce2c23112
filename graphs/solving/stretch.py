# SPDX-License-Identifier: BSD-3-Clause
"""A stretch of one recording: its normal equations, with all states but those at its ends eliminated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.inner_states import LinearisedStretch, Point
from jointscope.graphs.solving.normal_equations import costs, parts_of
from jointscope.graphs.solving.solver_context import side_by_side

Array = NDArray[np.float64]

LONG = 20_000  # states of a recording from which memory is what is scarce
DOUBTS = 2  # linearisations after a rejected step before which a trial may be the next one that is rejected
AT_REST = 1e-9  # share of the cost, less than which inner states gain no more


@dataclass(frozen=True)
class Place:
    """Both ends of each stretch of a recording, shape (d,) each, and the shared values."""

    ends: tuple[tuple[Array, ...], ...]
    calibration: Calibration


class GraphStretch(Protocol):
    """What a graph asks of a stretch, wherever that is; as of `RecordingStretch`."""

    @property
    def ticks(self) -> tuple[int, ...]:
        """First and last tick in the recording, or none."""

    @property
    def size(self) -> int:
        """Number of columns: both ends, then the free blocks."""

    @property
    def states(self) -> Array:
        """All states at the last evaluated point, shape (m, d)."""

    @property
    def costs(self) -> Array:
        """Cost of each tick there, shape (m,)."""

    def columns(self, block: str) -> slice:
        """Columns of a free block."""

    def damp(self, damping: float, bends: Array | None) -> None:
        """Sets the damping of all states, larger where `bends` says so, of all states of the recording."""

    def visit(self, ends: Sequence[Array], calibration: Calibration) -> float:
        """Evaluates everything at new ends and shared values; returns the cost there."""

    def settle(self) -> tuple[Array, Array, float]:
        """Makes the visited point the linearisation point: H, shape (n, n), g, shape (n,), and the cost left."""


class Elsewhere(Protocol):
    """Who keeps recordings of motion beside this process; it is asked for all of them at once."""

    def cut(
        self, problem: BagProblem, x: Array, calibration: Calibration, length: int, blocks: Sequence[str]
    ) -> tuple[GraphStretch, ...]:
        """Takes the next recording; arguments as of `cut`."""

    def visit(self, places: Sequence[Place]) -> None:
        """Evaluates all recordings at their places."""

    def linearise(self, places: Sequence[Place], damping: float, bends: Sequence[Array]) -> None:
        """Makes these places the ones where they are linearised, with the damping of `CondensedGraph.linearized`."""

    def fetch_states(self, places: Sequence[Place]) -> None:
        """Brings all states at these places."""


class RecordingStretch:
    """Samples of one recording between two ticks.

    Inner states follow from where the stretch was linearised last; after that this linearisation is not needed unless
    the step is rejected. So a trial may take its memory until a first one is rejected, from when on both are kept.
    A trial that is accepted is where the stretch is linearised next, so it is linearised at once; where the last ones
    were rejected, only its cost is worked out, which says soon enough whether it is the place to go on from.

    Args:
        problem: the factors of these samples alone, ticks counted from the first.
        x: states to begin with, shape (m, d), m >= 2.
        calibration: shared values to begin with.
        start: tick of the first state in its recording.
        blocks: names of the blocks that may change.
        keeps_both: whether both are kept from the beginning: short recordings have room for what they may need again.

    Attributes:
        damping: Levenberg-Marquardt lambda of each state, relative to the diagonal, shape (m,).
    """

    def __init__(
        self,
        problem: BagProblem,
        x: Array,
        calibration: Calibration,
        start: int,
        blocks: Sequence[str],
        keeps_both: bool = True,
    ):
        self.problem, self._start = problem, start
        self.damping = np.zeros(len(x))
        own = calibration.columns
        kept = np.concatenate([np.arange(own[b].start, own[b].stop) for b in blocks] or [np.zeros(0, int)])
        self._columns, self._size = rim_columns(x.shape[1], calibration, blocks)
        self._keeps_both = keeps_both
        self._sizes = problem, kept, start, len(x), x.shape[1], calibration.size
        self._kept = [self._room()]
        self._base = self._trial = self._kept[0].move(x.copy(), calibration, self.damping)
        self._damped_with, self._begin, self._inner_steps = self.damping, self._base, 0
        self._doubts = 0  # linearisations to come before which only the cost of a trial is worked out

    @property
    def ticks(self) -> tuple[int, ...]:
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
    def costs(self) -> Array:
        """Cost of each tick there, shape (m,)."""
        return self._trial.costs

    def columns(self, block: str) -> slice:
        """Columns of a free block."""
        return self._columns[block]

    def damp(self, damping: float, bends: Array | None) -> None:
        """Sets the damping of all states, larger where `bends` says so, of all states of the recording."""
        first, last = self.ticks
        own = np.zeros(len(self.damping)) if bends is None else bends[first : last + 1]
        self.damping = np.maximum(own, damping)

    def begin_here(self, inner_steps: int) -> None:
        """Makes the cost depend on its place alone: inner states go to their minimum from where they are now.

        Without, they follow from the last linearisation by one linear step, as a solver needs, wherever that was.

        Args:
            inner_steps: at the most, to a minimum.
        """
        self._inner_steps = inner_steps
        self._go_inside(self._base.x[0], self._base.x[-1], self._base.calibration)
        self._begin = self._base

    def visit(self, ends: Sequence[Array], calibration: Calibration) -> float:
        """Evaluates everything at new ends and shared values; returns the cost there."""
        first, last = ends
        if self._base.is_at(first, last, calibration):
            if self._trial is not self._base:  # it was rejected
                self._doubts = DOUBTS
            self._trial = self._base
        elif not self._trial.is_at(first, last, calibration):
            if self._inner_steps:
                self._base, self._damped_with = self._begin, np.zeros(len(self.damping))
            self._trial = self._base
            if not self._base.is_at(first, last, calibration):
                self._trial = self._tried(self._following(first, last, calibration), calibration)
                self._go_inside(first, last, calibration)
        return self._trial.cost

    def _tried(self, x: Array, calibration: Calibration) -> Point:
        """A place to go to, linearised if it is likely to be the next one."""
        if not self._doubts or self._inner_steps:
            return self._free_room().move(x, calibration, self.damping)
        by_tick = costs(self.problem, x, calibration)
        return Point(x, calibration, float(np.sum(by_tick)), by_tick)

    def _go_inside(self, first: Array, last: Array, calibration: Calibration) -> None:
        """Takes the inner states to their minimum, while the ends stay."""
        for _ in range(self._inner_steps):
            before = self._base = self._trial
            self._damped_with = self.damping
            x = self._following(first, last, calibration)
            self._trial = self._free_room().move(x, calibration, self.damping)
            if not self._trial.cost < before.cost * (1.0 - AT_REST):
                if not self._trial.cost < before.cost:
                    self._trial = before
                break
        if self._inner_steps:
            self._base, self._damped_with = self._trial, self.damping

    def settle(self) -> tuple[Array, Array, float]:
        """Makes the visited point the linearisation point: H, shape (n, n), g, shape (n,), and the cost left."""
        if self._trial is not self._base:
            self._doubts = max(self._doubts - 1, 0)
        self._base, self._damped_with = self._trial, self.damping
        found = self._linearised().inner
        return found.H, found.g, self._base.cost - found.gain

    def _linearised(self) -> LinearisedStretch:
        """The linearisation at the base, made anew where a trial has taken its memory."""
        own = next((found for found in self._kept if found.point is self._base), None)
        if own is not None and own.is_damped(self._damped_with):
            return own
        if own is None and not self._keeps_both:  # a step was rejected
            self._keeps_both = True
            self._kept = [self._room()]
        room, begins = own or self._free_room(), self._base is self._begin
        self._base = self._trial = room.move(self._base.x, self._base.calibration, self._damped_with)
        if begins:
            self._begin = self._base
        return room

    def _room(self) -> LinearisedStretch:
        return LinearisedStretch(*self._sizes, whole=self._keeps_both)

    def _free_room(self) -> LinearisedStretch:
        """Memory for another linearisation."""
        free = [found for found in self._kept if found.point is not self._base]
        if not free and self._keeps_both:
            free = [self._room()]
            self._kept += free
        return (free or self._kept)[0]

    def _following(self, first: Array, last: Array, calibration: Calibration) -> Array:
        """All states, the inner ones where the last linearisation puts them for new ends and shared values."""
        inner, base = self._linearised().inner, self._base
        x = base.x.copy()
        x[0], x[-1] = first, last
        change = np.zeros(base.calibration.size)
        for block in self._columns:
            change[base.calibration.columns[block]] = base.calibration.local(calibration, block)
        x[1:-1] += inner.states(first - base.x[0], last - base.x[-1], change)
        return x


def rim_columns(d: int, calibration: Calibration, blocks: Sequence[str]) -> tuple[dict[str, slice], int]:
    """Columns of the free blocks behind those of two states of size d, and the number of all columns."""
    columns, n = dict[str, slice](), 2 * d
    for block in blocks:
        columns[block] = slice(n, n + calibration.block_size(block))
        n += calibration.block_size(block)
    return columns, n


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

    def stretch(part: tuple[int, int, BagProblem]) -> RecordingStretch:
        a, b, samples = part
        return RecordingStretch(samples, x[a : b + 1], calibration, a, blocks, keeps_both=len(x) < LONG)

    return side_by_side(stretch, parts_of(problem, length))
