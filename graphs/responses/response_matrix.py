# SPDX-License-Identifier: BSD-3-Clause
"""The frequency response matrix of a system with its noise and total covariance.

    G_r(k) = Y_r(k) U_r(k)^-1 of each realisation r, columns of U and Y its experiments;    G = mean over r

What changes from period to period is noise. What changes with the random phases is the total: noise and the distortions
of a nonlinear system, which periods repeat faithfully (Pintelon and Schoukens, System Identification, 2012, ch. 4).
With one realisation the scatter of neighbouring lines about a smooth curve takes its place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.responses.buried_inputs import BURIED, noise_answers
from jointscope.graphs.responses.neighbouring_lines import (
    NEIGHBOURS,
    response_sizes,
    squares_at,
    squares_of_neighbours,
)
from jointscope.graphs.responses.spectra import Spectra
from jointscope.robots.errors import RecordingError

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
MANY = 8  # realisations that tell the covariance of a line without its neighbours
WORST_CONDITION = 1e3  # of the inputs of a block


@dataclass(frozen=True)
class ResponseMatrix:
    """A frequency response matrix.

    Attributes:
        frequencies: of the excited lines, shape (l,) [Hz].
        G: outputs over inputs, shape (l, ny, nu).
        noise: covariance of G from period to period, of its entries row by row, shape (l, ny nu, ny nu); None with one
            period.
        total: the same with the distortions.
        each: the matrix of each realisation, shape (r, l, ny, nu).
        inputs, outputs: names.
        periods: of each experiment.
        total_from: what the total covariance comes from, in words.
        buried: where an input hardly rises above its noise, shape (l, nu); None with one period.
    """

    frequencies: Array
    G: Complex
    noise: Complex | None
    total: Complex
    each: Complex
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    periods: int
    total_from: str
    buried: NDArray[np.bool_] | None = None

    def sigmas(self, covariance: Complex) -> Array:
        """Of the entries: root of the mean square distance in the complex plane, shape (l, ny, nu)."""
        variances = np.real(np.einsum("lii->li", covariance))
        return np.asarray(np.sqrt(np.maximum(variances, 0.0)).reshape(self.G.shape))

    def relative(self, covariance: Complex) -> Array:
        """Typical sigma over the size of each entry, shape (ny, nu)."""
        return np.asarray(np.median(self.sigmas(covariance) / np.maximum(np.abs(self.G), 1e-300), axis=0))


def response_matrix(found: Spectra) -> ResponseMatrix:
    """The response of a system.

    Raises:
        RecordingError: fewer experiments than inputs, or inputs that move together.
    """
    lines, blocks = found.excitation.lines, found.blocks
    U, Y = (np.swapaxes(X.mean(axis=1)[:, lines], 0, 1) for X in (found.U, found.Y))  # (l, e, c)
    _check_blocks(found, U)
    inverses = [np.linalg.pinv(np.swapaxes(U[:, block], 1, 2)) for block in blocks]  # (l, e, nu)
    each = np.array([np.swapaxes(Y[:, b], 1, 2) @ inverse for b, inverse in zip(blocks, inverses, strict=True)])
    G = each.mean(axis=0)
    noise = None if found.periods < 2 else _noise(found, G, inverses)
    R = len(each)
    again = len({e.realisation for e in found.excitation.experiments}) - len(np.unique(found.realisations))
    if R > 1:
        miss = each - G
        if R < MANY:
            total = squares_of_neighbours(miss, G, _inputs(inverses)) / ((R - 1) * R)
        else:
            miss = miss.reshape(R, len(lines), -1)
            total = np.einsum("rla,rlb->lab", miss, miss.conj()) / ((R - 1) * R)
        text = f"the scatter of {R} realisations" + (f", {2 * NEIGHBOURS + 1} lines together" if R < MANY else "")
    else:
        total = _about_neighbours(G, _inputs(inverses))
        text = "the scatter of neighbouring lines, as there is one realisation; record others with other random phases"
    buried = None
    if found.periods > 1:
        share, moved = noise_answers(found, G, inverses)
        buried, moved = share > BURIED, moved.reshape(len(lines), -1)
        total = total + moved[:, :, None] * moved[:, None, :].conj()
    if again:
        text += f" ({again} said to be others have the same phases, which show noise alone)"
    return ResponseMatrix(
        found.excitation.frequencies, G, noise, total, each, found.inputs, found.outputs, found.periods, text, buried
    )


def _inputs(inverses: list[Complex]) -> Array:
    """How large inputs are, what is left of an output over how far its entries move with it, shape (l, nu).

    A controller takes most of a slow excitation away.
    """
    moves = np.mean([np.sum(np.abs(inverse) ** 2, axis=1) for inverse in inverses], axis=0)
    return np.asarray(1.0 / np.sqrt(np.maximum(moves, 1e-300)))


def _check_blocks(found: Spectra, U: Complex) -> None:
    nu = len(found.inputs)
    for block in found.blocks:
        if len(block) < nu:
            raise RecordingError(
                f"{found.path}: {len(block)} experiments for {nu} inputs; expected as many as inputs, each with "
                "another combination of their signs or phases: record more, or name fewer inputs with --from"
            )
        size = np.abs(U[:, block]).max(axis=(0, 1))
        condition = np.linalg.cond(U[:, block] / np.maximum(size, 1e-300))
        worst = int(np.argmax(condition))
        if condition[worst] > WORST_CONDITION:
            raise RecordingError(
                f"{found.path}: at {found.excitation.frequencies[worst]:g} Hz the inputs move together in all "
                f"experiments (condition {condition[worst]:.2g}); expected orthogonal experiments, or fewer "
                "inputs: --from"
            )


def _noise(found: Spectra, G: Complex, inverses: list[Complex]) -> Complex:
    """Covariance of G by what its experiments change from period to period."""
    lines, P, R = found.excitation.lines, found.periods, len(inverses)
    E = found.Y[:, :, lines] - np.einsum("lij,eplj->epli", G, found.U[:, :, lines])
    E = E - E.mean(axis=1, keepdims=True)
    left = [
        np.einsum("epli,lea->eplia", E[block], inverse).reshape(-1, *G.shape)
        for block, inverse in zip(found.blocks, inverses, strict=True)
    ]
    return squares_of_neighbours(np.concatenate(left), G, _inputs(inverses)) / ((P - 1) * P * R**2)


def _about_neighbours(G: Complex, inputs: Array) -> Complex:
    """Covariance of G by its scatter about fractions (b0 + b1 d + b2 d^2) / (1 + a d) through neighbouring lines d.

    A fraction follows a resonance between two lines, which a polynomial does not (local rational method, McKelvey and
    Guerin, 2012). `inputs` are as large as they say, shape (l, nu).
    """
    n, width = len(G), 2 * NEIGHBOURS + 1
    if n < width:
        raise RecordingError(
            f"{n} lines and one realisation do not determine a covariance; record another realisation of the phases"
        )
    found = np.zeros((n, G[0].size, G[0].size), dtype=complex)
    d = np.arange(-NEIGHBOURS, NEIGHBOURS + 1) / NEIGHBOURS
    powers = np.vander(d, 3).astype(complex)
    for k in range(n):
        first = min(max(k - NEIGHBOURS, 0), n - width)
        own = slice(first, first + width)
        left = np.empty_like(G[own])
        for i, a in np.ndindex(*G.shape[1:]):
            g, weight = G[own, i, a], inputs[own, a]
            A = np.column_stack([powers, -g * d])
            x = np.linalg.lstsq(A * weight[:, None], g * weight, rcond=None)[0]
            left[:, i, a] = (g - A @ x) / (1.0 + x[3] * d)
        responses = response_sizes(G[own] - left, inputs[own])
        found[k] = squares_at(left[None], responses, inputs[own], k - first) * width / (width - 4)
    return found
