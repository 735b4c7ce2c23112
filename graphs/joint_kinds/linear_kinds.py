# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of an arm linearised at its calibrated values, kind by kind, under one prior.

A fit of the model with one more effect, on all recordings or without a fold of one kind, is then a small system of
equations in the values, what poses have of their own (points of contacts), and the parameters of the effect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Out = tuple[str, int]
"""Kind and number of a fold that a fit leaves out."""


class LinearKind(Protocol):
    """All recordings of a kind.

    Attributes:
        kind: its name.
        r, J: whitened residuals, shape (rows,), and columns of all values, shape (rows, p).
        folds: number of its folds.
        counted: number of measured values of separate causes.
    """

    @property
    def kind(self) -> str:
        """Its name."""

    @property
    def r(self) -> Array:
        """Whitened residuals, shape (rows,)."""

    @property
    def J(self) -> Array:
        """Whitened columns of all values, shape (rows, p)."""

    @property
    def folds(self) -> int:
        """Number of its folds."""

    @property
    def counted(self) -> float:
        """Number of measured values of separate causes."""

    def equations(self, extra: Array, out: int | None = None) -> tuple[Array, Array]:
        """Information of all columns and of extra ones, shape (p + k, p + k), and slope of the cost, shape (p + k,).

        Args:
            extra: whitened columns, shape (rows, k).
            out: a fold that is left out.
        """

    def left_out(self, extra: Array, step: Array, fold: int) -> float:
        """Squared distances of a fold after a step that it was not fitted to [sigma^2]."""


@dataclass(frozen=True)
class LinearKinds:
    """All kinds under one prior.

    Attributes:
        parts: the kinds.
        tied: information on the columns from priors and known distances, shape (p, p).
        pull: slope of the cost of these at the calibrated values, shape (p,).
    """

    parts: Sequence[LinearKind]
    tied: Array
    pull: Array

    def fitted(self, extra: Mapping[str, Array], sigmas: Array, out: Out | None = None) -> tuple[Array, Array, float]:
        """Step of all columns and of extra ones, shape (p + k,), its covariance, and by how much chi2 falls.

        The fall is that of an effect beyond a step of the others alone, which may be one where stages had not settled.

        Args:
            extra: whitened columns of an effect in each kind, shape (rows, k); a kind that it does nothing in may lack.
            sigmas: of its parameters, shape (k,).
            out: a fold that is left out.
        """
        p, k = len(self.tied), len(sigmas)
        H, slope = np.zeros((p + k, p + k)), np.zeros(p + k)
        for part in self.parts:
            there = np.arange(p + k if part.kind in extra else p)
            left = out[1] if out is not None and out[0] == part.kind else None
            A, g = part.equations(extra.get(part.kind, np.zeros((0, 0))), left)
            H[np.ix_(there, there)] += A
            slope[there] += g
        H[:p, :p] += self.tied
        H[p:, p:] += np.diag(sigmas**-2.0)
        slope[:p] += self.pull
        covariance = np.asarray(np.linalg.inv(H), dtype=np.float64)
        step = -covariance @ slope
        alone = float(slope[:p] @ np.linalg.solve(H[:p, :p], slope[:p]))
        return step, covariance, -float(slope @ step) - alone

    def of(self, part: LinearKind, extra: Mapping[str, Array], step: Array) -> tuple[Array, Array]:
        """Columns of an effect in a kind, and what of a step it sees."""
        here = extra.get(part.kind)
        return (np.zeros((0, 0)), step[: len(self.tied)]) if here is None else (here, step)
