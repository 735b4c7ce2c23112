# SPDX-License-Identifier: BSD-3-Clause
"""Covariances by neighbouring lines: what is left at one line is too little to tell how much it scatters.

What neighbours leave is as large as theirs where sensors of the outputs are noisy, and as large as their response where
inputs are, or where distortion arises before the system: beside a resonance, or where a mass is shaken slowly, these
are worlds apart (at the lowest line of an arm sigmas had been three times too small, five lines above five too large).
Which of both it is the neighbours tell, output by output: the likelier one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
NEIGHBOURS = 4  # lines on each side that are taken together where realisations are few


def over_neighbours(covariance: Complex, each_side: int = NEIGHBOURS) -> Complex:
    """Mean of each line, shape (l, ...), and its neighbours on each side, fewer at the ends."""
    sums = np.concatenate([np.zeros_like(covariance[:1]), np.cumsum(covariance, axis=0)])
    low, high = _window(len(covariance), each_side)
    return np.asarray((sums[high] - sums[low]) / (high - low)[:, None, None])


def neighbours(lines: int, each_side: int = NEIGHBOURS) -> Array:
    """How many lines `over_neighbours` takes together, shape (l,)."""
    low, high = _window(lines, each_side)
    return np.asarray(high - low, dtype=np.float64)


def _window(lines: int, each_side: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    return np.maximum(np.arange(lines) - each_side, 0), np.minimum(np.arange(lines) + each_side + 1, lines)


def squares_of_neighbours(left: Complex, G: Complex, inputs: Array) -> Complex:
    """Sum over samples of what is left of G, its entries row by row, as neighbouring lines tell it, shape (l, n, n).

    Args:
        left: samples of what is left, shape (m, l, ny, nu).
        G: response, shape (l, ny, nu).
        inputs: how large they are, shape (l, nu).
    """
    responses = response_sizes(G, inputs)
    low, high = _window(len(G), NEIGHBOURS)
    return np.array(
        [
            squares_at(left[:, a:b], responses[a:b], inputs[a:b], k - a)
            for k, (a, b) in enumerate(zip(low, high, strict=True))
        ]
    )


def response_sizes(G: Complex, inputs: Array) -> Array:
    """How large outputs are by inputs of their mean size, shape (l, ny)."""
    mean = np.mean(inputs**2, axis=0)
    return np.asarray(np.sqrt(np.maximum(np.abs(G) ** 2 @ mean, 1e-300)))


def squares_at(left: Complex, responses: Array, inputs: Array, k: int) -> Complex:
    """The same at line k of a window, shape (n, n).

    Args:
        left: shape (m, w, ny, nu).
        responses: shape (w, ny).
        inputs: shape (w, nu).
        k: the line, from the first one of the window.
    """
    outputs = np.stack([np.ones_like(responses), responses])  # as large everywhere, or as large as the response
    squares = np.sum(np.abs(left * inputs[:, None, :]) ** 2, axis=0)
    means = np.mean(squares / outputs[..., None] ** 2, axis=1)  # (2, ny, nu)
    unlikely = np.sum(np.log(np.maximum(means, 1e-300)), axis=2)
    unlikely += 2.0 * left.shape[3] * np.mean(np.log(outputs), axis=1)
    chosen = np.argmin(unlikely, axis=0)
    scale = (outputs[chosen, :, np.arange(len(chosen))].T[:, :, None] / inputs[:, None, :]).reshape(len(inputs), -1)
    x = left.reshape(*left.shape[:2], -1) / scale
    mean = np.einsum("mwa,mwb->ab", x, x.conj()) / len(inputs)
    return np.asarray(mean * scale[k][:, None] * scale[k])
