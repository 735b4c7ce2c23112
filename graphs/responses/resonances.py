# SPDX-License-Identifier: BSD-3-Clause
"""Resonances and anti-resonances of one entry of a response matrix, with sigmas.

About each peak and each dip of its size a fraction of two polynomials of degree two is fitted,
G = (b0 + b1 s + b2 s^2) / (a0 + a1 s + s^2), weighted with the total covariance; poles are those of the peak, zeros
those of the dip. A root s has the frequency |s| and the damping -Re s / |s|.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import find_peaks

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
STANDS_OUT = 0.7  # of the logarithm: how far a peak is above both sides, a factor of two
SIGMAS = 4.0  # and in sigmas of the scatter of lines
REACH = 0.25  # of its frequency to both sides: the lines that are fitted
FEWEST = 10  # lines
MOST_DAMPING = 0.7
MISFIT = 2.0  # chi-square per degree of freedom from which modes farther away count: more of the other polynomial
WIDER = 4  # its degree then
FEWEST_PER_VALUE = 2  # equations
BESIDE = 0.1  # of its frequency: how far roots may be from the peak
TOLD = 0.05  # of its frequency: the largest sigma of one that is reported


@dataclass(frozen=True)
class Resonance:
    """A pair of poles or zeros.

    Attributes:
        output, input: which entry of the matrix.
        frequency, frequency_sigma: [Hz].
        damping, damping_sigma: of the critical one.
        anti: whether it is a dip.
    """

    output: int
    input: int
    frequency: float
    frequency_sigma: float
    damping: float
    damping_sigma: float
    anti: bool


def resonances(frequencies: Array, G: Complex, sigmas: Array) -> list[Resonance]:
    """All that stand out, entry by entry, upwards.

    Args:
        frequencies: shape (l,) [Hz].
        G: response, shape (l, ny, nu).
        sigmas: of its entries, shape (l, ny, nu).
    """
    found = []
    for i in range(G.shape[1]):
        for j in range(G.shape[2]):
            own = [r for anti in (False, True) for r in _of_entry(frequencies, G[:, i, j], sigmas[:, i, j], i, j, anti)]
            found += sorted(own, key=lambda r: r.frequency)
    return found


def _of_entry(f: Array, G: Complex, sigma: Array, i: int, j: int, anti: bool) -> list[Resonance]:
    """Peaks or dips of one entry."""
    size, relative, found = np.log(np.abs(G)), sigma / np.abs(G), []
    peaks, shape = find_peaks(-size if anti else size, prominence=STANDS_OUT)
    for k, prominence in zip(peaks.tolist(), shape["prominences"].tolist(), strict=True):
        near = np.abs(f - f[k]) < REACH * f[k]
        if prominence < SIGMAS * float(np.median(relative[near])):
            continue
        fit = _fitted(f, G, sigma, k, anti)
        stable = fit is not None and (anti or fit[2] > 0.0)
        if fit is not None and stable and fit[1] < TOLD * fit[0] and abs(fit[0] - f[k]) < BESIDE * f[k]:
            found.append(Resonance(i, j, *fit, anti))
    return found


def _fitted(f: Array, G: Complex, sigma: Array, peak: int, anti: bool) -> tuple[float, float, float, float] | None:
    """Frequency and damping of the roots at a peak, each with its sigma; None where the lines do not tell them."""
    near = np.flatnonzero(np.abs(f - f[peak]) < REACH * f[peak])
    if len(near) < FEWEST:
        near = np.arange(max(peak - FEWEST // 2, 0), min(peak + FEWEST // 2 + 1, len(f)))
    s = 1j * f[near] / f[peak]
    scale = float(np.abs(G[near]).mean())
    g, weight = G[near] / scale, scale / np.maximum(sigma[near], 1e-12 * scale)
    fit = _fraction(s, g, weight, 2, 2)
    if fit is not None and fit[2] > MISFIT and 2 * len(near) >= FEWEST_PER_VALUE * (WIDER + 3):
        wider = _fraction(s, g, weight, *((2, WIDER) if anti else (WIDER, 2)))
        fit = wider if wider is not None and wider[2] < fit[2] else fit
    if fit is None:
        return None
    x, covariance, _ = fit
    own = slice(0, 3) if anti else slice(len(x) - 2, len(x))
    return _root(x[own], covariance[own, own], anti, float(f[peak]))


def _fraction(s: Complex, g: Complex, weight: Array, above: int, below: int) -> tuple[Array, Array, float] | None:
    """Coefficients of a fraction of polynomials, the last one below one; covariance; chi-square per degree."""
    powers = np.stack([s**k for k in range(max(above, below) + 1)], axis=1)
    n = above + 1

    def residual(x: Array) -> Array:
        r = weight * ((powers[:, :n] @ x[:n]) / (powers[:, : below + 1] @ np.append(x[n:], 1.0)) - g)
        return np.concatenate([r.real, r.imag]) * np.sqrt(2.0)

    start = _linear_start(powers, g, weight, n, below)
    x_scale = np.maximum(np.abs(start), 1e-3 * np.abs(start).max())
    fit = least_squares(residual, start, x_scale=x_scale, max_nfev=200)
    chi2 = 2.0 * fit.cost / max(len(fit.fun) - len(start), 1)
    try:
        return fit.x, np.linalg.inv(fit.jac.T @ fit.jac) * max(chi2, 1.0), chi2
    except np.linalg.LinAlgError:
        return None


def _linear_start(powers: Complex, g: Complex, weight: Array, n: int, below: int) -> Array:
    """Levy's linear fit, weighted anew by its own denominator (Sanathanan and Koerner, 1963)."""
    x, under = np.zeros(n + below), np.ones_like(g)
    for _ in range(10):
        w = (weight / np.abs(under))[:, None]
        A = w * np.hstack([powers[:, :n], -g[:, None] * powers[:, :below]])
        b = w[:, 0] * g * powers[:, below]
        x = np.linalg.lstsq(np.vstack([A.real, A.imag]), np.concatenate([b.real, b.imag]), rcond=None)[0]
        under = powers[:, : below + 1] @ np.append(x[n:], 1.0)
    return x


def _root(x: Array, covariance: Array, anti: bool, f: float) -> tuple[float, float, float, float] | None:
    c = x if anti else np.append(x, 1.0)
    if c[0] * c[2] <= 0.0:
        return None
    w = float(np.sqrt(c[0] / c[2]))
    zeta = float(c[1] / c[2] / (2.0 * w))
    if abs(zeta) > MOST_DAMPING or abs(np.log(w)) > REACH:
        return None
    by_w = np.array([w / (2.0 * c[0]), 0.0, -w / (2.0 * c[2])])
    by_zeta = np.array([0.0, 1.0 / (2.0 * w * c[2]), -zeta / c[2]]) - zeta / w * by_w
    J = np.stack([by_w, by_zeta])
    own = covariance if anti else np.pad(covariance, ((0, 1), (0, 1)))
    sigma_w, sigma_zeta = np.sqrt(np.maximum(np.diag(J @ own @ J.T), 0.0))
    return f * w, f * float(sigma_w), zeta, float(sigma_zeta)
