# SPDX-License-Identifier: BSD-3-Clause
"""Dry friction at rest: the torque y that it holds is anywhere within its band [-s, s], known up to noise.

    L(y | s) = (Phi((y + s) / sigma) - Phi((y - s) / sigma)) / (2 s)

Its logarithm pulls s down, and each y outside pushes it up. It is no sum of squares: the cost is

    c = -log(L sigma sqrt(2 pi)) >= 0

with its gradient, its curvature, and the information that one rest gives on average. -log L falls like log s as long as
s is wide, and only the few y at the edges bend it: a step by the average information, which is that of the edges, would
be as long as they are wide, and a band far too wide would hardly move. The largest y of many rests, as Ho and Kisner,
eq. (46), take it, is the limit for small sigma; it is too small where there are few rests.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, ndtr

Array = NDArray[np.float64]
LOG_2PI = float(np.log(2.0 * np.pi))
RATIOS = np.geomspace(1e-2, 1e4, 61)  # s / sigma of the table of information
FAR_INSIDE = 6.0  # [sigma] from the edge, where the likelihood is that of a sharp band to 1e-9
NODES = 4001  # of the integrals behind it


@dataclass(frozen=True)
class BandCost:
    """Cost of m torques and its derivatives, shape (m,) each.

    Attributes:
        cost: never negative.
        by_torque, by_half: gradient by y and by s [1/(N m)].
        torque_information, half_information: expected second derivatives [1/(N m)^2]; the mixed one is zero.
        curvature: second derivatives by (y, y), (y, s), (s, s) without those of log s, which are negative: a positive
            semidefinite matrix, since the other part of the cost is convex, shape (3, m) [1/(N m)^2].
    """

    cost: Array
    by_torque: Array
    by_half: Array
    torque_information: Array
    half_information: Array
    curvature: Array


def band_cost(y: Array, half: Array, sigma: Array) -> BandCost:
    """Cost of torques within bands.

    Args:
        y: torques less the middle of their bands, shape (m,) [N m].
        half: half widths s > 0, shape (m,) [N m].
        sigma: noise of the torques, shape (m,) [N m].
    """
    a, b = (y + half) / sigma, (y - half) / sigma
    # Phi(a) - Phi(b) on the side where both are small, without losing digits in the tails
    log_p = _log_difference(np.where(y > 0.0, -b, a), np.where(y > 0.0, -a, b))
    cost = np.log(2.0 * half / sigma) - log_p - 0.5 * LOG_2PI
    phi_a, phi_b = (np.exp(-0.5 * z * z - 0.5 * LOG_2PI - log_p) for z in (a, b))
    by_torque = -(phi_a - phi_b) / sigma
    by_half = -(phi_a + phi_b) / sigma + 1.0 / half
    log_ratio = np.log(np.clip(half / sigma, RATIOS[0], RATIOS[-1]))
    of_y, of_s = (np.interp(log_ratio, np.log(RATIOS), part) for part in _information())
    of_a, of_b, of_both = phi_a * (a + phi_a), phi_b * (phi_b - b), -phi_a * phi_b
    curvature = np.stack([of_a + 2.0 * of_both + of_b, of_a - of_b, of_a - 2.0 * of_both + of_b]) / sigma**2
    return BandCost(cost, by_torque, by_half, np.exp(of_y) / sigma**2, np.exp(of_s) / sigma**2, curvature)


def piled_cost(y: Array, half: Array, sigma: Array, share: Array, depth: Array) -> Array:
    """The cost alone, where a share w of the torques lies in piles below the edges of the band.

    A motor that slid to where it rests had all of its friction, and lost little of it since; one whose torque changed
    afterwards has any. Piles reach down from the edges by a part h of s, and are even: what lies deep in them may not
    push the edge beyond the largest torques.

        L = (1 - w) (Phi((y + s) / sigma) - Phi((y - s) / sigma)) / (2 s) + w (E(s - y) + E(s + y)) / 2
        E(d) = (Phi(d / sigma) - Phi((d - h s) / sigma)) / (h s)

    Args:
        y: torques less the middle of their bands, shape (k, m) [N m].
        half: half widths s > 0, shape (k, m) [N m].
        sigma: noise of the torques, shape (m,) [N m].
        share: w, between 0 and 1, shape (k,).
        depth: h, between 0 and 1, shape (k,).

    Returns:
        Shape (k, m).
    """
    half, sigma = np.broadcast_to(half, y.shape), np.broadcast_to(sigma, y.shape)
    deep = depth[:, None] * half
    below = (half - np.abs(y)) / sigma
    spread, pile = np.log(0.5 / half), np.full_like(y, -np.inf)
    spread += np.log1p(-share)[:, None]
    near, within = below < FAR_INSIDE, below - deep / sigma < FAR_INSIDE
    spread[near] += _log_difference(below[near], -((half + np.abs(y)) / sigma)[near])
    of_pile = _log_difference(below[within], (below - deep / sigma)[within])
    pile[within] = of_pile + (np.log(0.5 * share)[:, None] - np.log(deep))[within]
    return np.asarray(-np.logaddexp(spread, pile) - np.log(sigma) - 0.5 * LOG_2PI)


def _log_difference(upper: Array, lower: Array) -> Array:
    """log(Phi(upper) - Phi(lower)) for upper > lower, of which the lower one is negative where both are far out."""
    log_upper, log_lower = log_ndtr(upper), log_ndtr(lower)
    # far out or in a narrow band both are the same number; the slope of the logarithm says how far apart they are
    slope = np.exp(-0.5 * upper * upper - 0.5 * LOG_2PI - log_upper)
    apart = np.maximum(log_upper - log_lower, np.maximum((upper - lower) * slope, 1e-300))
    return np.asarray(log_upper + np.log(-np.expm1(-apart)))


@cache
def _information() -> tuple[Array, Array]:
    """Logarithm of sigma^2 times the information on y and on s, at RATIOS."""
    of_y, of_s = [], []
    for s in RATIOS:
        edge = np.linspace(-10.0, 10.0, NODES)
        y = np.unique(np.concatenate([edge + s, edge - s, np.linspace(-s - 10.0, s + 10.0, NODES)]))
        upper, lower = np.exp(-0.5 * (y + s) ** 2), np.exp(-0.5 * (y - s) ** 2)
        upper, lower = upper / np.sqrt(2.0 * np.pi), lower / np.sqrt(2.0 * np.pi)
        p = np.where(y > 0.0, ndtr(s - y) - ndtr(-s - y), ndtr(y + s) - ndtr(y - s))
        kept = p > 1e-300
        score_y = np.where(kept, (upper - lower) / np.where(kept, p, 1.0), 0.0)
        score_s = np.where(kept, (upper + lower) / np.where(kept, p, 1.0), 0.0) - 1.0 / s
        of_y.append(np.trapezoid(score_y**2 * p, y) / (2.0 * s))
        of_s.append(np.trapezoid(score_s**2 * p, y) / (2.0 * s))
    return np.log(of_y), np.log(of_s)
