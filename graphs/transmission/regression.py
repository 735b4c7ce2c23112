# SPDX-License-Identifier: BSD-3-Clause
"""Least squares over the equations of several recordings, each with constants of its own.

The constants (zeros of encoders, biases of gyros) are taken out equation by equation; what is left is linear in the
sizes that all recordings share.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.transmission.equation import Equation

Array = NDArray[np.float64]
Choose = Callable[[Equation], NDArray[np.bool_]]
JACKKNIFE = 8  # blocks left out one by one; their spread is the uncertainty, coloured errors included


def everything(equation: Equation) -> NDArray[np.bool_]:
    """All samples."""
    return np.ones(len(equation.times), dtype=bool)


def one_block(number: int, count: int) -> Choose:
    """The samples of one of `count` blocks of an equation, in the order of time."""
    return lambda e: np.asarray(np.arange(len(e.times)) * count // len(e.times) == number)


def without_block(number: int, count: int) -> Choose:
    """All samples but those of one block."""
    chosen = one_block(number, count)
    return lambda e: ~chosen(e)


@dataclass(frozen=True)
class Part:
    """An equation without its constants.

    Attributes:
        name: of the equation.
        error: shape (r,) [sigma].
        columns: shape (r, p) [sigma per unit of the size].
    """

    name: str
    error: Array
    columns: Array


def parts(equations: Sequence[Equation], names: Sequence[str], choose: Choose = everything) -> list[Part]:
    """The chosen samples of each equation, constants taken out, in sigmas."""
    found = []
    for equation in equations:
        kept = choose(equation)
        if not kept.any():
            continue
        rows = equation.error[kept].reshape(-1)
        nothing = np.zeros_like(equation.error)
        columns = np.column_stack([rows, *(equation.columns.get(name, nothing)[kept].reshape(-1) for name in names)])
        constants = equation.constants[kept].reshape(len(rows), -1)
        columns = columns - constants @ np.linalg.lstsq(constants, columns, rcond=None)[0]
        found.append(Part(equation.name, columns[:, 0] / equation.sigma, columns[:, 1:] / equation.sigma))
    return found


def fitted(pieces: Sequence[Part]) -> Array:
    """Sizes of least squared error, shape (p,); zero for a column that nothing excites."""
    A = np.vstack([piece.columns for piece in pieces])
    y = np.concatenate([piece.error for piece in pieces])
    if not A.shape[1]:
        return np.zeros(0)
    scale = np.linalg.norm(A, axis=0)
    scale[scale == 0.0] = np.inf
    return np.asarray(np.linalg.lstsq(A / scale, y, rcond=1e-9)[0] / scale, dtype=float)


def spread(equations: Sequence[Equation], names: Sequence[str]) -> Array:
    """Standard deviations of the sizes by leaving out blocks of time, shape (p,)."""
    found = np.array([fitted(parts(equations, names, without_block(k, JACKKNIFE))) for k in range(JACKKNIFE)])
    return np.asarray(np.sqrt((JACKKNIFE - 1) * np.var(found, axis=0)))


def errors(pieces: Sequence[Part], sizes: Array) -> dict[str, float]:
    """Root mean square of what is left of each equation, all recordings together [sigma]."""
    squares: dict[str, list[Array]] = {}
    for piece in pieces:
        squares.setdefault(piece.name, []).append((piece.error - piece.columns @ sizes) ** 2)
    return {name: float(np.sqrt(np.mean(np.concatenate(found)))) for name, found in squares.items()}


def total(by_equation: dict[str, float]) -> float:
    """Root mean square over the equations."""
    return float(np.sqrt(np.mean(np.square(list(by_equation.values())))))
