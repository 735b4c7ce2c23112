# SPDX-License-Identifier: BSD-3-Clause
"""The response matrix of a record without whole periods, by polynomials over neighbouring lines.

The spectra of any stretch of a linear system are

    Y(k) = G(w) U(k) + T(w) + V(k)

with T from what the system did before the stretch and does after it. Like G it is smooth where U of noise, or of a
multisine that is cut off, is rough: both are polynomials of second order over some lines about each, found by least
squares; what is left tells the covariance of V, noise and distortions together (Pintelon, Schoukens, Vandersteen,
Barbe, 2010: Estimation of nonparametric noise and FRF models for multivariable systems).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.responses.response_matrix import WORST_CONDITION, ResponseMatrix
from jointscope.graphs.responses.spectra import Spectra
from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.signals import Excitation, Experiment, Signal, Signals

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
ORDER = 2  # of the polynomials
SPARE = 7  # lines about each beyond as many as there are coefficients: they tell the covariance
GAP = 1.5  # steps without a sample end a stretch
SAME_RATE = 1e-3
EXCITED = 1e-3  # of the median power of the inputs' lines within the band where most of it is
MOST_POWER = 0.99  # of each input, that band
FEWEST = 4  # lines at which a response is told


def response_without_periods(signals: Signals) -> tuple[Spectra, ResponseMatrix]:
    """Spectra of the longest stretch without a gap, and the response of it.

    Raises:
        RecordingError: it is too short, clocks differ, inputs move together, or nothing was excited.
    """
    u, y, step, start, late = _stretch(signals)
    n, nu = len(u), u.shape[1]
    U, Y = (np.fft.rfft(x - x.mean(axis=0), axis=0)[: n // 2] / n for x in (u, y))
    Y = Y * np.exp(-2j * np.pi * np.arange(len(Y)) / (n * step) * late)[:, None]
    side = ((ORDER + 1) * (nu + 1) + SPARE) // 2
    at = _lines(U, side)
    if len(at) < FEWEST:
        raise RecordingError(
            f"{signals.path}: {n * step:.3g} s without whole periods tell the response at {len(at)} lines, "
            f"{2 * side + 1} neighbours each; record longer, or whole periods (docs/frequency.md)"
        )
    fits = [_fit(U, Y, int(k), side) for k in at]
    worst = int(np.argmax([condition for _, _, condition in fits]))
    if fits[worst][2] > WORST_CONDITION:
        raise RecordingError(
            f"{signals.path}: near {at[worst] / (n * step):.4g} Hz the inputs move together "
            f"(condition {fits[worst][2]:.2g}); expected inputs that move by themselves, or fewer of them: --from"
        )
    G, total = np.array([G for G, _, _ in fits]), np.array([covariance for _, covariance, _ in fits])
    says = f"no whole periods: polynomials of order {ORDER} over {2 * side + 1} lines about each"
    excitation = Excitation(1.0 / (n * step), at, (Experiment(0, 0, 1, start, 1),), source=says)
    names = signals.inputs.names, signals.outputs.names
    found = Spectra(signals.path, excitation, *names, U[None, None], Y[None, None], None, np.zeros(1, dtype=np.intp))
    text = "what the polynomials leave, noise and distortions together"
    return found, ResponseMatrix(excitation.frequencies, G, None, total, G[None], *names, 1, text)


def _stretch(signals: Signals) -> tuple[Array, Array, float, float, float]:
    """Inputs and outputs of the longest stretch, step, begin [s], and by how much outputs are later [s]."""
    inputs, outputs = signals.inputs, signals.outputs
    if abs(inputs.step / outputs.step - 1.0) > SAME_RATE:
        raise RecordingError(
            f"{signals.path}: inputs come at {1.0 / inputs.step:.4g} Hz, outputs at {1.0 / outputs.step:.4g} Hz; "
            "without whole periods both must have one rate: record them so, or whole periods (docs/frequency.md)"
        )
    step, best = inputs.step, (0.0, 0.0)
    for begin, end in _even_parts(inputs):
        for other, last in _even_parts(outputs):
            first = max(begin, other)
            if min(end, last) - first > best[1] - best[0]:
                best = first, min(end, last)
    count = round((best[1] - best[0]) / step) + 1
    if count < 3:
        raise RecordingError(f"{signals.path}: inputs and outputs have no stretch without gaps in common")
    (u, at), (y, then) = (signal.even(best[0], count, signals.path) for signal in (inputs, outputs))
    return u, y, step, at, then - at


def _even_parts(signal: Signal) -> list[tuple[float, float]]:
    edges = np.flatnonzero(np.diff(signal.times) > GAP * signal.step) + 1
    return [(float(part[0]), float(part[-1])) for part in np.split(signal.times, edges)]


def _lines(U: Complex, side: int) -> NDArray[np.intp]:
    """Lines that are told: within the band of every input, half a window apart, where all inputs are excited."""
    power = np.abs(U) ** 2
    width = 2 * side + 1
    smooth = np.stack([np.convolve(p, np.ones(width) / width, mode="same") for p in power.T], axis=1)
    share = np.cumsum(power, axis=0) / np.maximum(power.sum(axis=0), 1e-300)
    within = np.all((share > 0.5 * (1.0 - MOST_POWER)) & (share < 0.5 * (1.0 + MOST_POWER)), axis=1)
    if not np.any(within):
        return np.zeros(0, dtype=np.intp)
    excited = np.all(smooth > EXCITED * np.median(smooth[within], axis=0), axis=1)
    inside = np.arange(side + 1, len(U) - side, max(side // 2, 1))
    return np.asarray(inside[(excited & within)[inside]], dtype=np.intp)


def _fit(U: Complex, Y: Complex, k: int, side: int) -> tuple[Complex, Complex, float]:
    """G at a line, shape (ny, nu), the covariance of its entries row by row, and the condition of the inputs."""
    window = slice(k - side, k + side + 1)
    powers = np.vander(np.arange(-side, side + 1) / side, ORDER + 1, increasing=True)
    u, y = U[window], Y[window]
    size = np.sqrt(np.mean(np.abs(u) ** 2, axis=0))
    given = np.concatenate([u / size, np.ones((len(u), 1))], axis=1)
    K = (powers[:, :, None] * given[:, None, :]).reshape(len(u), -1)  # powers slowest: G, T of order 0 first
    Q, R = np.linalg.qr(K)
    inverse = np.linalg.pinv(R)
    nu = u.shape[1]
    x = inverse @ (Q.conj().T @ y)
    left = y - K @ x
    noise = left.T @ left.conj() / (len(u) - K.shape[1])
    own = (inverse @ inverse.conj().T)[:nu, :nu] / np.outer(size, size)
    total = np.einsum("ij,ab->iajb", noise, own.conj()).reshape(y.shape[1] * nu, -1)
    return (x[:nu] / size[:, None]).T, total, float(np.linalg.cond(u / size))
