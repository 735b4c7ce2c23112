# SPDX-License-Identifier: BSD-3-Clause
"""The Gauss-Newton system of one recording, accumulated from factors in batches.

States form a chain, so the Hessian is block tridiagonal with a border for the shared values:

    [ A  B ] [dx]     [g_x]        A: D(k) on the diagonal, E(k) = d2/dX(k+1)dX(k) below it
    [ B' C ] [dp] = - [g_p]
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.factor import Factor, Linearization
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.sensor_placement import Placed
from jointscope.graphs.solving.solver_context import side_by_side

Array = NDArray[np.float64]

Linearized = tuple[Factor, NDArray[np.intp], Linearization]
"""Some samples of a factor, the first tick of each, and their linearization."""

_NONE = np.zeros(0, dtype=np.intp)
CHUNK = 1024  # samples linearised at once: large enough for numpy, small enough for the cache


@dataclass
class NormalEquations:
    """Block tridiagonal Hessian with a border, and gradient.

    Attributes:
        D: diagonal blocks, shape (m, d, d).
        E: blocks below the diagonal, shape (m - 1, d, d).
        B: border, shape (m, d, p).
        C: corner, shape (p, p).
        g_x: gradient by the states, shape (m, d).
        g_p: gradient by the shared values, shape (p,).
        cost: half the sum of squared whitened residuals.
        costs: the share of each tick in it, shape (m,).
        D_next, g_next: the part of D and g_x that comes from factors reaching on to the next state; only where asked.
    """

    D: Array
    E: Array
    B: Array
    C: Array
    g_x: Array
    g_p: Array
    cost: float
    costs: Array
    D_next: Array | None = None
    g_next: Array | None = None

    @staticmethod
    def zeros(m: int, d: int, p: int, split: bool = False) -> NormalEquations:
        """An empty system for m states of size d and p shared values."""
        parts = (np.zeros((m, d, d)), np.zeros((m, d))) if split else (None, None)
        return NormalEquations(
            np.zeros((m, d, d)),
            np.zeros((max(m - 1, 0), d, d)),
            np.zeros((m, d, p)),
            np.zeros((p, p)),
            np.zeros((m, d)),
            np.zeros(p),
            0.0,
            np.zeros(m),
            *parts,
        )

    @staticmethod
    def gaussian(
        calibration: Calibration, names: Sequence[str], at: Array, A: Array, g: Array | None = None, cost: float = 0.0
    ) -> NormalEquations:
        """What a Gaussian on some dynamic parameters says of the shared values; it has no states.

        Args:
            calibration: shared values.
            names: of the parameters, shape (p,); there may be others beside.
            at: their coordinates where slope and cost are these, shape (p,).
            A: information, shape (p, p).
            g: slope, shape (p,); None for the least cost.
            cost: there.
        """
        system = NormalEquations.zeros(0, 1, calibration.size)
        places = [calibration.names.index(name) for name in names]
        columns = np.arange(calibration.size)[calibration.columns[DYNAMICS]][places]
        away = calibration.dynamics[places] - at
        pull, slope = A @ away, np.zeros(len(away)) if g is None else g
        system.C[np.ix_(columns, columns)] += A
        system.g_p[columns] += slope + pull
        system.cost += cost + float(slope @ away) + 0.5 * float(away @ pull)
        return system


def build(
    problem: BagProblem,
    x: Array,
    calibration: Calibration,
    split: bool = False,
    into: NormalEquations | None = None,
) -> NormalEquations:
    """Linearises all factors of a recording.

    Args:
        problem: the factors.
        x: states, shape (m, 4n).
        calibration: shared values, with the biases of this recording.
        split: keep apart what reaches on to the next state, as a filter needs it.
        into: an empty system that takes them, if there is memory already.
    """
    return accumulate(linearize_all(problem, x, calibration), x, calibration, split, into=into)


def accumulate(
    linearized: Iterable[Linearized],
    x: Array,
    calibration: Calibration,
    split: bool = False,
    with_shared: bool = True,
    into: NormalEquations | None = None,
) -> NormalEquations:
    """Sums linearised factors; arguments as in `build`.

    Without shared values, which are known then, the linearizations must hold no derivatives by them.
    """
    columns = calibration.columns
    p = calibration.size if with_shared else 0
    system = into or NormalEquations.zeros(len(x), x.shape[1], p, split)
    for factor, ticks, linear in linearized:
        _accumulate(system, factor, ticks, linear, columns)
    return system


def linearize_all(
    problem: BagProblem, x: Array, calibration: Calibration, dynamics_only: bool = False
) -> Iterator[Linearized]:
    """All factors chunk by chunk: factor, first tick of each sample, linearization."""
    m = len(problem.dynamics)

    def steps(start: int) -> Linearized:
        stop = min(start + CHUNK, m)
        part = problem.dynamics.select(slice(start, stop))
        return part, np.arange(start, stop), part.linearize_chain(x[start : stop + 1], calibration)

    def samples(piece: tuple[Factor, NDArray[np.intp]]) -> Linearized:
        factor, ticks = piece
        return factor, ticks, factor.linearize(states_of(factor, ticks, x), calibration)

    threads = 0 if m > CHUNK else 1  # handing over takes longer than what is short
    yield from side_by_side(steps, range(0, m, CHUNK), threads)
    if not dynamics_only:
        yield from side_by_side(samples, (piece for placed in problem.placed for piece in chunks(placed)), threads)


def parts_of(problem: BagProblem, length: int) -> Iterator[tuple[int, int, BagProblem]]:
    """First and last tick of each stretch, and its factors; side by side, of about `length` steps each."""
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
        yield a, b, replace(problem, dynamics=problem.dynamics.select(slice(a, b)), placed=tuple(placed))


def cost(problem: BagProblem, x: Array, calibration: Calibration) -> float:
    """Half the sum of squared whitened residuals."""
    alone = [placed.factor for placed in problem.placed if placed.factor.states == 0]
    squares = (np.sum((factor.residual((), calibration) / factor.sigmas) ** 2) for factor in alone)
    return float(np.sum(costs(problem, x, calibration))) + 0.5 * float(sum(squares))


def costs(problem: BagProblem, x: Array, calibration: Calibration) -> Array:
    """The share of each tick in the cost, as `NormalEquations.costs`, shape (m,).

    Without derivatives, that takes a sixth of the time of normal equations.
    """
    steps = problem.dynamics
    found = np.zeros(len(x))
    found[:-1] = _squares(steps.residual((x[:-1], x[1:]), calibration), steps.sigmas)
    for placed in problem.placed:
        factor, ticks = placed.factor, placed.ticks
        if factor.states:
            squares = _squares(factor.residual(states_of(factor, ticks, x), calibration), factor.sigmas)
            found += np.bincount(ticks, squares, len(x))
    return found


def _squares(residual: Array, sigmas: Array) -> Array:
    """Half the squared whitened residual of each sample, shape (m,)."""
    whitened = residual / sigmas
    return 0.5 * np.einsum("kr,kr->k", whitened, whitened)


def chunks(placed: Placed) -> Iterable[tuple[Factor, NDArray[np.intp]]]:
    """A placed factor in pieces."""
    for start in range(0, len(placed.factor), CHUNK):
        part = slice(start, start + CHUNK)
        yield placed.factor.select(part), placed.ticks[part]


def states_of(factor: Factor, ticks: NDArray[np.intp], x: Array) -> tuple[Array, ...]:
    """The states that each sample touches."""
    return tuple(x[ticks + i] for i in range(factor.states))


def whitened(factor: Factor, linear: Linearization) -> tuple[Array, tuple[Array, ...], dict[str, Array]]:
    """Residual and Jacobians divided by the sigmas."""
    weight = 1.0 / np.broadcast_to(factor.sigmas, linear.residual.shape)
    column = weight[:, :, None]
    by_block = {block: J * column for block, J in linear.by_block.items()}
    return linear.residual * weight, tuple(J * column for J in linear.by_state), by_block


def _accumulate(
    system: NormalEquations,
    factor: Factor,
    ticks: NDArray[np.intp],
    linear: Linearization,
    columns: dict[str, slice],
) -> None:
    from jointscope.graphs.kernels.accumulation import add_squares  # numba takes half a second to import

    m, rows = linear.residual.shape
    d, p = system.D.shape[1], [*linear.by_block.values(), np.zeros((m, rows, 0))]
    places = np.concatenate([np.arange(columns[b].start, columns[b].stop) for b in linear.by_block] + [_NONE])
    none, nothing = np.zeros((0, rows, d)), np.zeros((0, d))
    J = (*linear.by_state, none, none)[:2]
    weights = 1.0 / np.broadcast_to(factor.sigmas, (m, rows))
    parts = (weights, linear.residual, p[0] if len(p) == 2 else np.concatenate(p, axis=2), *J)
    system.cost += add_squares(
        *(np.ascontiguousarray(part) for part in parts),
        np.asarray(ticks, dtype=np.intp),
        places,
        system.D,
        system.E,
        system.B,
        system.C,
        system.g_x,
        system.g_p,
        system.costs,
        nothing[:, :, None] if system.D_next is None else system.D_next,
        nothing if system.g_next is None else system.g_next,
    )


def add_at(target: Array, index: NDArray[np.intp], values: Array) -> None:
    """Adds values to target[index] where an index may repeat; the indices are sorted."""
    if len(index) == 0:
        return
    first = np.flatnonzero(np.diff(index, prepend=index[0] - 1))
    if len(first) == len(index):
        if index[-1] - index[0] == len(index) - 1:
            target[index[0] : index[-1] + 1] += values
        else:
            target[index] += values
    else:
        target[index[first]] += np.add.reduceat(values, first, axis=0)
