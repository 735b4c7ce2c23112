# SPDX-License-Identifier: BSD-3-Clause
"""Where a link that swings on comes to rest: the middle of its swing, which a coarse encoder tells better than a rest.

    q(t) = q0 + sum_k [exp(-d_k t) (a_k cos w_k t + b_k sin w_k t) + c exp(-2 d_k t) (a_k^2 + b_k^2)],  t = 0 at the end

A plain mean over some part of a swing is off by the part of a period that is left over. Rounding of an encoder is one
error as long as its reading stays the same, however many samples there are: they count as one together. A link that
stands says no more than its step over sqrt(12); one that swings across steps has an error of its own at each of them,
and their middle is known better than a step. Two modes at the most, each only if the samples ask for it (Schwarz,
Annals of Statistics 6 (1978)). The middle of a swing on a spring that is no straight line moves with the square of its
size: c is known as little as springs are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Array = NDArray[np.float64]
MOST_MODES = 2
FIRST, OF_MODE = 2, 4  # values: q0 and c; two amplitudes, frequency and decay
# [1/rad] sigma of c, which is K2 / (2 K) for a spring of K d + K2 d^2. All rests of a spring share its c: a sigma as
# small as c itself pulls all of their middles the same way, and the spring is off by more than its own sigma says
CURVED = 5.0
LOWEST, FINEST = 0.5, 0.2  # periods in the stretch, of the slowest swing that is tried, and from one to the next
PER_PERIOD = 4.0  # errors of their own that a period must have
SLOW, PEAKS = 30, 15  # frequencies from the slowest one on, and peaks of the spectrum, that are tried
DECAYS = (0.0, 0.05, 0.2)  # of the frequency w, where a swing is looked for
MOST_DECAY = 0.7  # of w; what decays faster does not swing
MOST_SAMPLES = 2000  # the last ones are looked at
COARSE = 1.0  # [sigma] an encoder whose smallest change is larger is rounded
SMALLEST = 1e-9  # of the information of all, that keeps a matrix from being singular


@dataclass(frozen=True)
class Middle:
    """Of a swing.

    Attributes:
        value: where it comes to rest [rad].
        sigma: of this, from the encoder's noise and from what no swing explains; not below that of a reading that is
            not rounded, since no mean says how well such an encoder repeats [rad].
    """

    value: float
    sigma: float


def middle_of_swing(times: Array, readings: Array, sigma: float) -> Middle | None:
    """The middle of a swing; None where samples do not show one.

    Args:
        times: shape (k,) [s], while motors and load stand.
        readings: of the link's encoder, shape (k,) [rad].
        sigma: of one reading [rad].
    """
    t, y = times[-MOST_SAMPLES:], readings[-MOST_SAMPLES:]
    shared = readings_alike(y)
    own = float(np.sum(1.0 / shared))  # number of errors
    if own <= FIRST + OF_MODE:
        return None
    t, root = t - t[-1], 1.0 / (sigma * np.sqrt(shared))
    mean = float(np.sum(root**2 * y) / np.sum(root**2))
    best, found = float(np.sum((root * (y - mean)) ** 2)) + np.log(own), None
    values = np.array([mean, 0.0])
    for modes in range(1, MOST_MODES + 1):
        count = FIRST + OF_MODE * modes
        begin = _with_one_more(t, y, root, values, own)
        if own <= count or begin is None:
            break
        values, J, cost = _fitted(t, y, root, begin)
        worth = cost + count * np.log(own)
        if worth >= best:
            break
        best, widened = worth, max(cost / (own - count), 1.0)
        information = J.T @ J
        size = np.sqrt(np.maximum(np.diag(information), 1e-300))
        scaled = information / np.outer(size, size) + SMALLEST * np.eye(count)
        found = Middle(float(values[0]), float(np.sqrt(widened * np.linalg.inv(scaled)[0, 0]) / size[0]))
    if found is None or not y.min() <= found.value <= y.max():
        return None
    changes = np.abs(np.diff(y))
    rounded = float(np.min(changes[changes > 0.0])) > COARSE * sigma
    return found if rounded else Middle(found.value, float(np.hypot(found.sigma, sigma)))


def readings_alike(readings: Array) -> Array:
    """How many samples in a row with the same reading each one belongs to, shape (k,)."""
    first = np.concatenate([[True], readings[1:] != readings[:-1]])
    group = np.cumsum(first) - 1
    return np.asarray(np.bincount(group)[group], dtype=float)


def swing(t: Array, values: Array) -> tuple[Array, Array]:
    """Positions, shape (k,), and their derivatives by the values, shape (k, 2 + 4 modes).

    Args:
        t: shape (k,) [s].
        values: q0 and c, then a, b, w and d of each mode [rad, 1/rad, rad, rad, rad/s, 1/s].
    """
    q, J, curved = np.full_like(t, values[0]), np.zeros((len(t), len(values))), values[1]
    J[:, 0] = 1.0
    for k in range(FIRST, len(values), OF_MODE):
        a, b, w, d = values[k : k + OF_MODE]
        decay = np.exp(-d * t)
        c, s = decay * np.cos(w * t), decay * np.sin(w * t)
        part, square = a * c + b * s, decay**2
        size = (a**2 + b**2) * square
        q += part + curved * size
        J[:, 1] += size
        by_a, by_b = c + 2.0 * curved * a * square, s + 2.0 * curved * b * square
        J[:, k : k + OF_MODE] = np.column_stack([by_a, by_b, t * (b * c - a * s), -t * (part + 2.0 * curved * size)])
    return q, J


def _with_one_more(t: Array, y: Array, root: Array, values: Array, own: float) -> Array | None:
    """Values to begin with: those of the modes so far and the best of one more on a grid."""
    length = -float(t[0])
    highest = own / PER_PERIOD / length
    if highest <= LOWEST / length:
        return None
    rest = root * (y - swing(t, values)[0])
    tried, share = np.meshgrid(_promising(t, root * rest, highest), DECAYS)
    w, d = tried.ravel(), (tried * share).ravel()
    decay = np.exp(-d[:, None] * (t - t[0])) * root
    scale = np.exp(d * t[0])  # of amplitudes at the end, over those at the begin
    waves = [np.broadcast_to(root, decay.shape), decay * np.cos(w[:, None] * t), decay * np.sin(w[:, None] * t)]
    X = np.stack(waves, axis=2)
    A, b = np.swapaxes(X, 1, 2) @ X, np.swapaxes(X, 1, 2) @ rest
    A += SMALLEST * np.trace(A, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    solved = np.linalg.solve(A, b[:, :, None])[:, :, 0]
    k = int(np.argmax(np.sum(solved * b, axis=1)))
    shift, *amplitudes = solved[k]
    return np.concatenate([[values[0] + shift, 0.0], values[FIRST:], np.array(amplitudes) * scale[k], [w[k], d[k]]])


def _promising(t: Array, weighted: Array, highest: float) -> Array:
    """Frequencies at which a swing is looked for: slow ones, and those at and beside peaks of the spectrum [rad/s].

    Args:
        t: shape (k,) [s].
        weighted: what is left of the readings by their weight, shape (k,).
        highest: that the readings can show [Hz].
    """
    length = -float(t[0])
    grid = np.arange(LOWEST / length, highest, FINEST / length)
    if len(grid) <= SLOW + 3 * PEAKS:
        return 2.0 * np.pi * grid
    even = np.interp(np.linspace(t[0], 0.0, len(t)), t, weighted)
    spectrum = np.abs(np.fft.rfft(even - even.mean(), n=round(len(t) / FINEST)))
    at = np.clip(np.round(grid * length / FINEST * len(t) / (len(t) - 1)).astype(int), 0, len(spectrum) - 1)
    power = spectrum[at]
    peaks = 1 + np.flatnonzero((power[1:-1] >= power[:-2]) & (power[1:-1] >= power[2:]))
    best = peaks[np.argsort(power[peaks])[-PEAKS:]]
    chosen = np.unique(np.concatenate([np.arange(SLOW), best - 1, best, best + 1]))
    return 2.0 * np.pi * grid[chosen]


def _fitted(t: Array, y: Array, root: Array, begin: Array) -> tuple[Array, Array, float]:
    """Likeliest values, whitened slopes there, and the sum of squares."""
    low, high, scale = np.full_like(begin, -np.inf), np.full_like(begin, np.inf), np.empty_like(begin)
    scale[0], scale[1] = np.ptp(y), CURVED
    for k in range(FIRST, len(begin), OF_MODE):
        w = begin[k + 2]
        low[k + 2], high[k + 2], low[k + 3], high[k + 3] = 0.5 * w, 2.0 * w, 0.0, MOST_DECAY * w
        scale[k : k + 2], scale[k + 2 : k + 4] = np.ptp(y), -1.0 / t[0]
    known = np.eye(len(begin))[1] / CURVED
    inside = np.clip(begin, low + 1e-9 * scale, high - 1e-9 * scale)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # steps far too long, which are taken back
        found = least_squares(
            lambda v: np.append(root * (swing(t, v)[0] - y), v[1] / CURVED),
            inside,
            jac=lambda v: np.vstack([root[:, None] * swing(t, v)[1], known]),
            bounds=(low, high),
            x_scale=scale,
            max_nfev=100,
        )
    return found.x, np.asarray(found.jac), 2.0 * float(found.cost)
