# SPDX-License-Identifier: BSD-3-Clause
"""Resonances and anti-resonances of one entry of a response matrix, with sigmas.

About each peak and each dip of its size a fraction of two polynomials of degree two is fitted,
G = (b0 + b1 s + b2 s^2) / (a0 + a1 s + s^2), weighted with the total covariance; poles are those of the peak, zeros
those of the dip. Where lines ask for more, one polynomial has degree four. A root s has the frequency |s| and the
damping -Re s / |s|. The fraction may be late by about a sample, as where an input that is held until the next one is
taken for a measured one: half a sample had made the damping of a dip 13 % too large, 3.8 of its sigmas. It may be
smaller at higher lines, too, as much as held inputs are. A noisy line is no resonance: without its roots lines must fit
worse.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import find_peaks

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
STANDS_OUT = 0.7  # of the logarithm: how far a peak is above both sides, a factor of two
SIGMAS = 4.0  # and in sigmas of the scatter of lines
NOISY = 0.3  # sigma over size from which lines are noise, whose dips are as deep as one likes
REACH = 0.25  # of its frequency to both sides: the lines that are fitted
FEWEST = 10  # lines
MOST_DAMPING = 0.7
WIDER = 4  # degree of one polynomial where modes farther away count
FEWEST_PER_VALUE = 2  # equations
BESIDE = 0.1  # of its frequency: how far roots may be from the peak
LATE = 1.0  # samples, 1 sigma of how late the response may be
WITHOUT = 100.0  # that chi-square rises without the roots, at least: noise of many lines makes it rise, too
SAME = 0.02  # of its frequency: another one that near is the same
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


def resonances(frequencies: Array, G: Complex, sigmas: Array, step: float) -> list[Resonance]:
    """All that stand out, entry by entry, upwards.

    Args:
        frequencies: shape (l,) [Hz].
        G: response, shape (l, ny, nu).
        sigmas: of its entries, shape (l, ny, nu).
        step: between two samples of the inputs [s].
    """
    found = []
    for i in range(G.shape[1]):
        for j in range(G.shape[2]):
            entry = _Entry(frequencies, G[:, i, j], sigmas[:, i, j], step)
            own = [Resonance(i, j, *fit, anti) for anti in (False, True) for fit in _of_entry(entry, anti)]
            found += sorted(own, key=lambda r: r.frequency)
    return found


@dataclass(frozen=True)
class _Entry:
    """One entry of a matrix: frequencies, response and its sigma, shape (l,) each, and step of the samples."""

    f: Array
    G: Complex
    sigma: Array
    step: float


def _of_entry(entry: _Entry, anti: bool) -> list[tuple[float, float, float, float]]:
    """Frequency and damping of the peaks or dips of one entry, each with its sigma."""
    f, size, relative = entry.f, np.log(np.abs(entry.G)), entry.sigma / np.abs(entry.G)
    found: list[tuple[float, tuple[float, float, float, float]]] = []
    peaks, shape = find_peaks(-size if anti else size, prominence=STANDS_OUT)
    for k, prominence in zip(peaks.tolist(), shape["prominences"].tolist(), strict=True):
        near = np.abs(f - f[k]) < REACH * f[k]
        scatter = float(np.median(relative[near]))
        if scatter > NOISY or prominence < SIGMAS * scatter:
            continue
        fit = _fitted(entry, k, anti)
        stable = fit is not None and (anti or fit[2] > 0.0)
        if fit is not None and stable and fit[1] < TOLD * fit[0] and abs(fit[0] - f[k]) < BESIDE * f[k]:
            found.append((abs(fit[0] - float(f[k])), fit))
    kept: list[tuple[float, float, float, float]] = []
    for _, fit in sorted(found):  # noisy lines beside a peak lead to the same roots
        if all(abs(fit[0] - other[0]) > max(SIGMAS * np.hypot(fit[1], other[1]), SAME * fit[0]) for other in kept):
            kept.append(fit)
    return kept


def _fitted(entry: _Entry, peak: int, anti: bool) -> tuple[float, float, float, float] | None:
    """Frequency and damping of the roots at a peak, each with its sigma; None where the lines do not tell them."""
    f, middle = entry.f, float(entry.f[peak])
    near = np.flatnonzero(np.abs(f - middle) < REACH * middle)
    if len(near) < FEWEST:
        near = np.arange(max(peak - FEWEST // 2, 0), min(peak + FEWEST // 2 + 1, len(f)))
    scale = float(np.abs(entry.G[near]).mean())
    g, weight = entry.G[near] / scale, scale / np.maximum(entry.sigma[near], 1e-12 * scale)
    s = np.asarray(1j * f[near] / middle, dtype=np.complex128)
    turn = 2.0 * np.pi * middle * entry.step
    lines = _Lines(s, g, weight, turn * LATE, turn**2 / 24.0 * (np.abs(s) ** 2 - 1.0))
    degrees = [(2, 2), (2, WIDER), (WIDER, 2)] if 2 * len(near) >= FEWEST_PER_VALUE * (WIDER + 3) else [(2, 2)]
    fit = lines.best(degrees)
    without = lines.best([(0, 2) if anti else (2, 0), (1, 1)])
    if fit is None or (without is not None and without.chi2 - fit.chi2 < WITHOUT * max(fit.misfit, 1.0)):
        return None
    own = slice(0, fit.above + 1) if anti else slice(fit.above + 1, len(fit.x))
    return _root(fit.x[own], fit.covariance[own, own], anti, middle)


@dataclass(frozen=True)
class _Fraction:
    """Coefficients, the last one below being one, their covariance, chi-square, and the same per degree of freedom."""

    above: int
    x: Array
    covariance: Array
    chi2: float
    misfit: float


@dataclass(frozen=True)
class _Lines:
    """Lines about a peak, shape (m,) each: s over its frequency, response and weights; how late it may be [rad].

    Held inputs are smaller by sin(x) / x, x being pi times frequency and step: `smaller` by that than at the peak.
    """

    s: Complex
    g: Complex
    weight: Array
    late: float
    smaller: Array

    def best(self, degrees: Sequence[tuple[int, int]]) -> _Fraction | None:
        """The fraction that fits best among some, each value worth the logarithm of the number of equations."""
        found = [fit for fit in (self.fraction(*degree) for degree in degrees) if fit is not None]
        if not found:
            return None
        scatter, price = max(min(fit.misfit for fit in found), 1.0), np.log(2 * len(self.g))
        return min(found, key=lambda fit: fit.chi2 / scatter + price * len(fit.x))

    def fraction(self, above: int, below: int) -> _Fraction | None:
        """The fraction of two polynomials of these degrees that fits best, late as it may be."""
        powers = np.stack([self.s**k for k in range(max(above, below) + 1)], axis=1)
        n = above + 1

        def residual(x: Array) -> Array:
            held = np.exp(-self.s * x[-2] * self.late) * (1.0 - x[-1] * self.smaller)
            g = held * (powers[:, :n] @ x[:n]) / (powers[:, : below + 1] @ np.append(x[n:-2], 1.0))
            r = self.weight * (g - self.g) * np.sqrt(2.0)
            return np.concatenate([r.real, r.imag, x[-2:]])

        start = np.append(_linear_start(powers, self.g, self.weight, n, below), [0.0, 0.0])
        x_scale = np.maximum(np.abs(start), 1e-3 * np.abs(start).max())
        x_scale[-2:] = 1.0
        fit = least_squares(residual, start, x_scale=x_scale, max_nfev=200)
        chi2 = 2.0 * fit.cost
        misfit = chi2 / max(len(fit.fun) - len(start), 1)
        try:
            covariance = np.linalg.inv(fit.jac.T @ fit.jac)[:-2, :-2] * max(misfit, 1.0)
        except np.linalg.LinAlgError:
            return None
        return _Fraction(above, fit.x[:-2], covariance, chi2, misfit)


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
    """Frequency and damping, each with its sigma, of the pair of roots of a polynomial that is nearest to a peak."""
    c = x if anti else np.append(x, 1.0)
    roots = np.roots(c[::-1])
    roots = roots[roots.imag > 0.0]
    if not len(roots):
        return None
    s = roots[np.argmin(np.abs(roots - 1j))]
    w, zeta = float(np.abs(s)), float(-s.real / np.abs(s))
    if abs(zeta) > MOST_DAMPING or abs(np.log(w)) > REACH:
        return None
    k = np.arange(len(x))
    slope = np.sum(np.arange(1, len(c)) * c[1:] * s ** np.arange(len(c) - 1))
    by_s = -(s**k) / slope  # of the root by the coefficients
    by_w = (s.conjugate() * by_s).real / w
    J = np.stack([by_w, -by_s.real / w - zeta / w * by_w])
    sigma_w, sigma_zeta = np.sqrt(np.maximum(np.diag(J @ covariance @ J.T), 0.0))
    return f * w, f * float(sigma_w), zeta, float(sigma_zeta)
