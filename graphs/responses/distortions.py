# SPDX-License-Identifier: BSD-3-Clause
"""What a system puts on lines at which nothing was excited: distortions of even and odd order, beside the noise.

What the input itself has there, as in a closed loop, is taken off with the response between the neighbouring lines.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.responses.response_matrix import ResponseMatrix
from jointscope.graphs.responses.spectra import Spectra

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Levels:
    """Amplitudes on some lines.

    Attributes:
        frequencies: shape (m,) [Hz].
        size: of each output, root mean square over experiments, shape (m, ny).
    """

    frequencies: Array
    size: Array


@dataclass(frozen=True)
class Distortions:
    """Amplitudes of the outputs by kind of line.

    Attributes:
        excited: at the lines that were excited.
        even, odd: at the others, between the first and the last of them.
        noise: of the mean over periods, at all of them; None with one period.
    """

    excited: Levels
    even: Levels
    odd: Levels
    noise: Levels | None


def distortions(found: Spectra, matrix: ResponseMatrix) -> Distortions:
    """The levels of a recording."""
    lines = found.excitation.lines
    every = np.arange(int(lines.min()), int(lines.max()) + 1)
    between = np.setdiff1d(every, lines)
    G = np.stack([_between(every, lines, entry) for entry in matrix.G.reshape(len(lines), -1).T], axis=1)
    G = G.reshape(len(every), *matrix.G.shape[1:])
    left = found.Y[:, :, every] - np.einsum("kij,epkj->epki", G, found.U[:, :, every])
    mean = left.mean(axis=1)

    def levels(k: NDArray[np.intp], X: NDArray[np.complex128]) -> Levels:
        size = np.sqrt(np.mean(np.abs(X[:, k - every[0]]) ** 2, axis=0))
        return Levels(np.asarray(found.excitation.f0 * k), np.asarray(size))

    noise = None
    if found.periods > 1:
        size = np.sqrt(np.mean(np.var(left, axis=1, ddof=1) / found.periods, axis=0))
        noise = Levels(np.asarray(found.excitation.f0 * every), np.asarray(size))
    return Distortions(
        levels(lines, found.Y.mean(axis=1)[:, every]),
        levels(between[between % 2 == 0], mean),
        levels(between[between % 2 == 1], mean),
        noise,
    )


def _between(at: NDArray[np.intp], lines: NDArray[np.intp], entry: NDArray[np.complex128]) -> NDArray[np.complex128]:
    return np.asarray(np.interp(at, lines, entry.real) + 1j * np.interp(at, lines, entry.imag))
