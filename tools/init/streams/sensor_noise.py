# SPDX-License-Identifier: BSD-3-Clause
"""Noise of a sensor from its own samples: the step of a counter, or what no smooth motion explains.

Divided differences of order m at the true times of the samples leave nothing of a polynomial of lower order, so
irregular sampling does not look like noise, and white noise gives each of them the variance sigma^2 sum w_i^2. The
higher the order, the less of a fast motion remains at a low rate; of white noise, all orders leave the same. So the
lowest order counts that leaves hardly more than the best one, in the quieter stretches.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.special import comb, gammaincinv

Array = NDArray[np.float64]

WHOLE = 0.02  # [step] how near to whole numbers of steps the samples of a counter are
MOST_WHOLE = 0.98  # share of the samples that must be
FEWEST_LEVELS = 20  # a counter that was never at more values than these says nothing about its step
WINDOW, STRETCHES = (20, 100), 12  # samples of one stretch, least and most; how many stretches there should be
QUIET = 0.25  # share of the stretches that are quieter than the one that counts
ORDERS = (2, 4, 6, 8, 10, 12)
ALIKE = 1.15  # ratio up to which two orders show the same noise
NEARLY_ALIKE = 1.35  # the same where it changes with the speed
AGREEING = 3  # orders that show the same where it is noise
MOVES = 0.5  # of the rms speed, from which a joint moves
NEAR = 9  # samples over which a speed is a mean
FEWEST_IN_MOTION = 80  # moments
REPEATS = 0.35  # share of samples that repeat the one before, from which a driver is faster than its device
ROUNDING = 1.3  # times a step over sqrt(12) that differences may show of rounding alone
FINEST = 1e-6  # of the range; no sensor is known to be better
SINGLE = 2.0**-24  # relative rounding error of single precision


@dataclass(frozen=True)
class NoiseGuess:
    """Standard deviation of a sample in the unit of the values, and how it was found."""

    sigma: float
    reason: str


def guess_noise(times: Array, values: Array, unit: str) -> NoiseGuess:
    """Noise of a sensor; the largest of its channels.

    Args:
        times: shape (n,) [s].
        values: samples, shape (n, m).
        unit: for the reason.
    """
    return max(guess_each(times, values, [unit] * values.shape[1]), key=lambda guess: guess.sigma)


def guess_each(times: Array, values: Array, units: Sequence[str]) -> list[NoiseGuess]:
    """Noise of each channel of a sensor.

    Args:
        times: shape (n,) [s].
        values: samples, shape (n, m).
        units: of the channels, for the reason.
    """
    rough = column_noise(times, values)
    return [_guess(column[:, None], found, unit) for column, found, unit in zip(values.T, rough, units, strict=True)]


def _guess(values: Array, rough: float, unit: str) -> NoiseGuess:
    step = _step(values[:, 0])
    # rounding is not quite white, so it looks somewhat rougher than it is
    if step > 0.0 and rough < ROUNDING * step / np.sqrt(12.0):
        return NoiseGuess(float(step / np.sqrt(12.0)), f"steps of {step:.3g} {unit} over sqrt(12)")
    floor, reason = _floor(values)
    if rough < floor:
        return NoiseGuess(floor, f"no noise to be seen: {reason}")
    return NoiseGuess(rough, "what no smooth motion explains, in quiet stretches")


def _floor(values: Array) -> tuple[float, str]:
    """The least noise that makes sense, and why."""
    good = values[np.isfinite(values)]
    if not len(good) or not np.ptp(good):
        return 0.0, ""
    least = FINEST * float(np.ptp(values, axis=0).max())
    rounding = SINGLE * float(np.abs(good).max()) if np.array_equal(good, good.astype(np.float32)) else 0.0
    if rounding > least:
        return rounding, "rounding of single precision"
    return least, "one millionth of the range"


def _step(values: Array) -> float:
    """The step of a counter; 0 where the values lie between steps."""
    levels = np.unique(values)
    if len(levels) < FEWEST_LEVELS:
        return 0.0
    gaps = np.diff(levels)
    # stored as floats, the same step differs in its last digits
    smallest = float(np.min(gaps[gaps > 1e-9 * float(np.ptp(levels))], initial=np.inf))
    if not np.isfinite(smallest):
        return 0.0
    alike = gaps[np.abs(gaps / smallest - 1.0) < 0.05]
    step = float(np.median(alike))
    # errors of a step add up over many of them: look at neighbours
    jumps = np.diff(values) / step
    whole = np.abs(jumps - np.rint(jumps)) < WHOLE
    return step if len(alike) > 3 and whole.mean() > MOST_WHOLE else 0.0


def column_noise(times: Array, values: Array) -> list[float]:
    """Standard deviation of the white noise of each column, 0 where none is seen.

    Args:
        times: strictly increasing, shape (n,) [s].
        values: finite samples, shape (n, m).
    """
    weights = {order: _weights(times, order) for order in ORDERS if len(times) > 2 * order}
    return [_roughness(times, column, weights) for column in values.T]


def _roughness(times: Array, values: Array, weights: Mapping[int, Array]) -> float:
    """Standard deviation of white noise, from the quieter stretches."""
    fresh = np.concatenate([[True], np.diff(values) != 0.0]) if len(values) else np.zeros(0, bool)
    if 1.0 - fresh.mean() > REPEATS and np.count_nonzero(fresh) > 2 * FEWEST_LEVELS and not _step(values):
        times, values = times[fresh], values[fresh]
        weights = {order: _weights(times, order) for order in ORDERS if len(times) > 2 * order}
    found = [_from_order(values, order, weight) for order, weight in weights.items()]
    alive = [sigma for sigma in found if sigma > 0.0]
    return next((sigma for sigma in alive if sigma < ALIKE * min(alive)), 0.0)


def noise_in_motion(times: Array, values: Array) -> float:
    """Standard deviation of white noise while a joint moves, 0 where what is seen is no noise.

    Stamps that jitter make noise of motion, none at rest. Of a motion that is too fast for the rate higher differences
    leave less and less, of noise all leave the same.

    Args:
        times: strictly increasing, shape (n,) [s].
        values: finite positions, shape (n,).
    """
    if len(times) < 2 * ORDERS[-1]:
        return 0.0
    speed = np.abs(np.convolve(np.gradient(values, times), np.full(NEAR, 1.0 / NEAR), mode="same"))
    moves = speed > MOVES * float(np.sqrt(np.mean(speed**2)))
    inside = np.flatnonzero(sliding_window_view(moves, ORDERS[-1] + 1).all(axis=1))
    if len(inside) < FEWEST_IN_MOTION:
        return 0.0
    found = []
    for order in ORDERS:
        rows = inside + (ORDERS[-1] - order) // 2  # the same moments by all orders
        weight = _weights(times, order)[rows]
        around = values[rows[:, None] + np.arange(order + 1)]
        found.append(float(np.sqrt(np.mean(np.sum(weight * (around - around[:, :1]), axis=1) ** 2))))
    alike = [sigma for sigma in found if 0.0 < sigma < NEARLY_ALIKE * min(found)]
    return float(np.median(alike)) if len(alike) >= AGREEING else 0.0


def _from_order(values: Array, order: int, weight: Array) -> float:
    """Noise by differences of one order: a low quantile of the stretches, as if it were one of white noise."""
    around = np.stack([values[i : i + len(weight)] for i in range(order + 1)], axis=1)
    rest = np.sum(weight * (around - around[:, :1]), axis=1) ** 2
    width = int(np.clip(len(rest) // STRETCHES, *WINDOW))
    count = max(len(rest) // width, 1)
    parts = rest[: count * (len(rest) // count)].reshape(count, -1).mean(axis=1)
    parts = parts[parts > 0.0]
    if not len(parts):
        return 0.0
    freedom = max(len(rest) / count / _correlated(order), 1.0)  # of chi square, in one stretch
    share = QUIET if len(parts) > 1 else 0.5
    return float(np.sqrt(np.quantile(parts, share) * freedom / (2.0 * gammaincinv(freedom / 2.0, share))))


def _weights(times: Array, order: int) -> Array:
    """Weights of samples in divided differences that have the variance of one sample, shape (n - order, order + 1)."""
    count = len(times) - order
    around = np.stack([times[i : i + count] for i in range(order + 1)], axis=1) / float(np.median(np.diff(times)))
    weight = np.ones_like(around)
    for i in range(order + 1):
        for j in range(order + 1):
            if i != j:
                weight[:, i] /= around[:, i] - around[:, j]
    return np.asarray(weight / np.linalg.norm(weight, axis=1, keepdims=True))


@cache
def _correlated(order: int) -> float:
    """Number of differences of white noise that count as one."""
    k = np.arange(-order, order + 1)
    return float(np.sum((comb(2 * order, order + k) / comb(2 * order, order)) ** 2))


def beside_cubics(times: Array, values: Array) -> Array:
    """Squared distance of each sample from the cubic through its neighbours, as variance of one sample, shape (n - 4,).

    Args:
        times: strictly increasing, shape (n,) [s].
        values: shape (n,).
    """
    if len(times) < 5:
        return np.zeros(0)
    left = np.zeros(len(times) - 4)
    gain = np.ones(len(times) - 4)
    middle = times[2:-2]
    around = [times[i : len(times) - 4 + i] for i in (0, 1, 3, 4)]
    for i, place in zip((0, 1, 3, 4), around, strict=True):
        others = [t for t in around if t is not place]
        weight = np.prod([(middle - t) / (place - t) for t in others], axis=0)
        left += weight * values[i : len(values) - 4 + i]
        gain += weight**2
    return np.asarray((values[2:-2] - left) ** 2 / gain)
