# SPDX-License-Identifier: BSD-3-Clause
"""Inputs that are buried in noise at some lines, where a response is that of the noise and not of the excitation.

Noise n of an input U makes Y / (U + n) not only uncertain: in the mean it is

    G (1 - e) + b e,    e = exp(-|U|^2 / E|n|^2)

with b what the output answers to n: nothing where a sensor makes it, the inverse of the controller in a closed loop
(Heath, 2001: Bias of indirect non-parametric transfer function estimates for plants in closed loop).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.responses.neighbouring_lines import over_neighbours
from jointscope.graphs.responses.spectra import Spectra

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
BURIED = 0.02  # of a response that is the noise's: at four times its power
LEAST = 0.1  # ratio of powers that is told from none
SMALL = 1e-12  # of the input's power: noise that is none


def noise_answers(found: Spectra, G: Complex, inverses: Sequence[Complex]) -> tuple[Array, Complex]:
    """How much of each column is the noise's, shape (l, nu), and by how much that moves G, shape (l, ny, nu).

    Args:
        found: spectra of two periods or more.
        G: response.
        inverses: of the inputs of each block, shape (l, e, nu).
    """
    lines, P = found.excitation.lines, found.periods
    U, Y = (X[:, :, lines] - X[:, :, lines].mean(axis=1, keepdims=True) for X in (found.U, found.Y))
    count = len(U) * (P - 1) * P
    of_inputs, of_both = (over_neighbours(np.einsum("epli,eplj->lij", X, U.conj()) / count) for X in (U, Y))
    power = np.real(np.einsum("lii->li", of_inputs))
    taken = np.stack([np.sum(np.abs(inverse) ** 2, axis=1) for inverse in inverses])  # (blocks, l, nu)
    above = np.mean(1.0 / np.maximum(taken * power, SMALL), axis=0) - 1.0
    share = np.exp(-np.maximum(above, LEAST))
    level = np.einsum("lii->l", of_inputs).real + SMALL * np.mean(np.abs(found.U) ** 2)
    answer = of_both @ np.linalg.pinv(of_inputs / level[:, None, None], hermitian=True) / level[:, None, None]
    return share, (G - answer) * (share / (1.0 - share))[:, None, :]
