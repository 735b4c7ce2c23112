# SPDX-License-Identifier: BSD-3-Clause
"""Equations linearised at a calibrated model, as products of their columns summed piece by piece.

A fit to any seconds, with any columns, is then a small system of equations; what each recording has for itself is
fitted along. Columns are taken without their means, so that sums of products keep their digits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.transmission.free_links import EquationRows

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
SECOND = 1.0  # [s] fitted and judged in turn
PIECE = 0.25  # [s] summed together
JACKKNIFE = 8  # blocks left out one by one; their spread is the uncertainty, coloured errors included


@dataclass(frozen=True)
class Place:
    """One equation in one recording.

    Attributes:
        name: of the equation.
        seconds: number of the second in which each piece lies, shape (b,).
        counts: measured values in each, shape (b,).
        products: of what is left, the columns and the constants, shape (b, 1 + p + c, 1 + p + c) [sigma^2].
        constants: c.
    """

    name: str
    seconds: NDArray[np.intp]
    counts: Array
    products: Array
    constants: int


Choose = Callable[[Place], Mask]


def everything(place: Place) -> Mask:
    """All pieces."""
    return np.ones(len(place.seconds), dtype=bool)


def fit_seconds(place: Place) -> Mask:
    """Every other second, which is fitted."""
    return np.asarray(place.seconds % 2 == 0)


def judged_seconds(place: Place) -> Mask:
    """The seconds between."""
    return ~fit_seconds(place)


def one_block(number: int, count: int) -> Choose:
    """The pieces of one of `count` blocks of equally many samples, in the order of time."""
    return lambda place: np.asarray(
        (np.cumsum(place.counts) - 0.5 * place.counts) * count // place.counts.sum() == number
    )


def without_block(number: int, count: int) -> Choose:
    """All pieces but those of one block."""
    chosen = one_block(number, count)
    return lambda place: ~chosen(place)


@dataclass(frozen=True)
class LinearEquations:
    """All equations of some recordings.

    Attributes:
        names: of all columns, shape (p,).
        places: one for each equation in each recording.
    """

    names: tuple[str, ...]
    places: tuple[Place, ...]

    @staticmethod
    def of(rows: Sequence[EquationRows], names: Sequence[str]) -> LinearEquations:
        """Sums all samples; a column that an equation does not have is zero there."""
        return LinearEquations(tuple(names), tuple(_place(r, names) for r in rows if len(r.equation.times)))

    def only(self, name: str) -> LinearEquations:
        """One equation alone."""
        return LinearEquations(self.names, tuple(place for place in self.places if place.name == name))

    def reduced(self, names: Sequence[str], choose: Choose = everything) -> Array:
        """Products of what is left and some columns without constants, shape (1 + k, 1 + k)."""
        index = self._index(names)
        total = np.zeros((len(index), len(index)))
        for place in self.places:
            G = place.products[choose(place)].sum(axis=0)
            own = len(G) - place.constants
            C = G[np.ix_(index, np.arange(own, len(G)))]
            total += G[np.ix_(index, index)] - C @ np.linalg.pinv(G[own:, own:]) @ C.T
        return total

    def fitted(self, names: Sequence[str], choose: Choose = everything) -> Array:
        """Sizes of least squared error, shape (k,); zero for a column that nothing excites."""
        G = self.reduced(names, choose)
        return solved_products(G[1:, 1:], G[1:, 0])

    def spread(self, names: Sequence[str]) -> Array:
        """Covariance of the sizes by leaving out blocks of time, shape (k, k)."""
        found = np.array([self.fitted(names, without_block(k, JACKKNIFE)) for k in range(JACKKNIFE)])
        apart = found - found.mean(axis=0)
        return np.asarray((JACKKNIFE - 1) / JACKKNIFE * apart.T @ apart)

    def squares(
        self, names: Sequence[str], sizes: Array, choose: Choose = everything
    ) -> list[tuple[str, Array, Array]]:
        """Of each place its equation, and of each chosen second the squares left [sigma^2] and their number."""
        index, found = self._index(names), []
        for place in self.places:
            chosen = choose(place)
            if not chosen.any():
                continue
            G, own = place.products[chosen], place.products.shape[1] - place.constants
            step = np.zeros(G.shape[1])
            step[index] = [1.0, *-sizes]
            total = G.sum(axis=0)
            step[own:] = -np.linalg.pinv(total[own:, own:]) @ (total[own:] @ step)
            _, first = np.unique(place.seconds[chosen], return_index=True)
            left = np.add.reduceat(np.einsum("i,bij,j->b", step, G, step), first)
            found.append((place.name, left, np.add.reduceat(place.counts[chosen], first)))
        return found

    def errors(self, names: Sequence[str], sizes: Array, choose: Choose = everything) -> dict[str, float]:
        """Root mean square of what is left of each equation, all recordings together [sigma]."""
        sums: dict[str, Array] = {}
        for name, squares, counts in self.squares(names, sizes, choose):
            sums.setdefault(name, np.zeros(2))
            sums[name] += squares.sum(), counts.sum()
        return {name: float(np.sqrt(max(s, 0.0) / count)) for name, (s, count) in sums.items()}

    def left(self, names: Sequence[str]) -> float:
        """Sum of squares that a fit of some columns leaves [sigma^2]."""
        G = self.reduced(names)
        return float(G[0, 0] - G[0, 1:] @ solved_products(G[1:, 1:], G[1:, 0]))

    def excites(self, place: Place, names: Sequence[str]) -> bool:
        """Whether an equation has any of some columns."""
        index = self._index(names)[1:]
        return bool(np.any(place.products[:, index, index]))

    def _index(self, names: Sequence[str]) -> NDArray[np.intp]:
        return np.array([0, *(1 + self.names.index(name) for name in names)], dtype=np.intp)


def solved_products(G: Array, b: Array) -> Array:
    """Least squares from products of columns, (k, k), with (k,) or (k, m); zero along what nothing excites."""
    scale = np.sqrt(np.diag(G))
    scale[scale == 0.0] = np.inf
    right = (b.T / scale).T
    return np.asarray(((np.linalg.pinv(G / np.outer(scale, scale), rcond=1e-12, hermitian=True) @ right).T / scale).T)


def _place(rows: EquationRows, names: Sequence[str]) -> Place:
    e, channels = rows.equation, rows.equation.measured.shape[1]
    nothing = np.zeros_like(e.measured)
    A = np.stack([e.measured - rows.predicted, *(e.columns.get(name, nothing) for name in names)], axis=2) / e.sigma
    A = A - A.mean(axis=0)
    A = np.concatenate([A, np.broadcast_to(np.eye(channels), (len(A), channels, channels))], axis=2)
    numbers, first = np.unique(np.floor(e.times / PIECE).astype(np.intp), return_index=True)
    pieces = [piece.reshape(-1, A.shape[2]) for piece in np.split(A, first[1:])]
    products = np.array([piece.T @ piece for piece in pieces])
    return Place(
        e.name,
        (numbers * PIECE // SECOND).astype(np.intp),
        np.array([float(len(piece)) for piece in pieces]),
        products,
        channels,
    )
