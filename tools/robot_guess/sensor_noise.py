# SPDX-License-Identifier: BSD-3-Clause
"""Noise of a sensor from its own samples: the step of a counter, or how badly neighbours predict a sample.

A smooth motion lies near the cubic through two samples on either side; what remains is noise. The cubic is that of the
true times, so irregular sampling does not look like noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WHOLE = 0.02  # [step] how near to whole numbers of steps the samples of a counter are
MOST_WHOLE = 0.98  # share of the samples that must be
WINDOW = 100  # samples of one stretch
QUIET = 0.25  # share of the stretches that are quieter than the one that counts
FEWEST_LEVELS = 20  # a counter that was never at more values than these says nothing about its step


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
    step = max((_step(column) for column in values.T), default=0.0)
    rough = max((_roughness(times, column) for column in values.T), default=0.0)
    if step / np.sqrt(12.0) >= rough and step > 0.0:
        return NoiseGuess(float(step / np.sqrt(12.0)), f"steps of {step:.3g} {unit} over sqrt(12)")
    return NoiseGuess(rough, "what remains beside the cubic through neighbouring samples in quiet stretches")


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


def _roughness(times: Array, values: Array) -> float:
    """Standard deviation of white noise, from the quieter stretches."""
    rest = beside_cubics(times, values)
    count = max(len(rest) // WINDOW, 1)
    by_window = np.array([np.sqrt(part.mean()) for part in np.array_split(rest, count) if len(part)])
    alive = by_window[by_window > 0.0]
    return float(np.quantile(alive, QUIET)) if len(alive) else 0.0


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
