# SPDX-License-Identifier: BSD-3-Clause
"""What a factor is here: one residual, vectorised over samples, with analytic Jacobians.

The same object serves three masters: the batch solver linearises all samples in one call, GTSAM gets one custom
factor per sample (single.py), and the reports read its residuals. Residuals are in physical units and their
noise is diagonal; `sigmas` whitens them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration

Array = NDArray[np.float64]
Samples = slice | NDArray[np.intp]
"""A choice of samples: a range, or their indices."""


@dataclass(frozen=True)
class Linearization:
    """Residuals of m samples with r rows, and their derivatives.

    Attributes:
        residual: predicted minus zero of the factor, shape (m, r), in the units of `Factor.sigmas`.
        by_state: derivative by each state the factor touches, shape (m, r, d) each.
        by_block: derivative by the coordinates of each block of the calibration, shape (m, r, size).
    """

    residual: Array
    by_state: tuple[Array, ...] = ()
    by_block: dict[str, Array] = field(default_factory=dict)


class Factor(Protocol):
    """One kind of residual for m samples."""

    @property
    def name(self) -> str:
        """Short name for messages and reports."""

    @property
    def rows(self) -> tuple[str, ...]:
        """Name of each row of the residual."""

    @property
    def states(self) -> int:
        """Number of states each sample touches (0, 1 or 2)."""

    @property
    def blocks(self) -> tuple[str, ...]:
        """Blocks of the calibration the residual depends on."""

    @property
    def sigmas(self) -> Array:
        """Standard deviation of each row, shape (r,) or (m, r)."""

    def __len__(self) -> int:
        """Number of samples."""

    def select(self, samples: Samples) -> Self:
        """The same factor for some of the samples."""

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Residuals, shape (m, r), at states of shape (m, d) each."""

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residuals and derivatives at states of shape (m, d) each."""
