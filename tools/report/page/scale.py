# SPDX-License-Identifier: BSD-3-Clause
"""Axes: from values to drawing units, and the ticks a reader expects (1, 2, 5 times a power of ten)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.presentation.numbers import SUPERSCRIPTS, minus

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scale:
    """One axis.

    Attributes:
        low, high: limits, in the unit of the values.
        length: length of the axis in drawing units.
        log: whether the axis is logarithmic.
        flip: whether large values lie at small coordinates (the vertical axis of a picture).
    """

    low: float
    high: float
    length: float
    log: bool = False
    flip: bool = False

    def __call__(self, values: Array | float) -> Array:
        """Coordinates of values, same shape, in drawing units."""
        x = np.asarray(values, dtype=float)
        low, high = self.low, self.high
        if self.log:
            x, low, high = np.log10(np.maximum(x, 1e-300)), math.log10(low), math.log10(high)
        # a value far outside (a diverged prediction) would otherwise become a number no browser draws
        share = np.clip((x - low) / (high - low), -3.0, 4.0)
        return self.length * (1.0 - share if self.flip else share)

    def ticks(self, count: int) -> list[tuple[float, str]]:
        """About `count` ticks: value and label."""
        return log_ticks(self.low, self.high) if self.log else nice_ticks(self.low, self.high, count)


def nice_ticks(low: float, high: float, count: int) -> list[tuple[float, str]]:
    """About `count` ticks at 1, 2, 5 times a power of ten; three at least, as two do not show a scale."""
    raw = (high - low) / max(count, 1)
    power = 10.0 ** math.floor(math.log10(raw))
    steps = [m * power for m in (0.2, 0.5, 1.0, 2.0, 5.0, 10.0)]
    wanted = next(i for i, step in enumerate(steps) if step >= raw * 0.999)
    step, first, last = steps[wanted], 0, 0
    for step in reversed(steps[max(wanted - 2, 0) : wanted + 1]):
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        if last - first >= 2:
            break
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    return [(k * step, minus(f"{k * step:.{decimals}f}")) for k in range(first, last + 1)]


def log_ticks(low: float, high: float) -> list[tuple[float, str]]:
    """Ticks at powers of ten; at 1, 2, 5 times them where fewer than two powers are in sight."""
    exponents = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    factors = (1.0,) if math.log10(high / low) >= 2.0 else (1.0, 2.0, 5.0)
    stride = max(1, round(math.log10(high / low) / 6.0))
    values = [m * 10.0**e for e in exponents for m in factors if e % stride == 0 or len(factors) > 1]
    return [(v, _power_label(v)) for v in values if low * 0.999 <= v <= high * 1.001]


def padded(low: float, high: float, share: float = 0.06) -> tuple[float, float]:
    """Limits with some air; limits that are equal or not finite get a range around them."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return 0.0, 1.0
    if high - low <= 1e-12 * max(abs(low), abs(high), 1e-300):
        half = 0.5 * abs(low) or 1.0
        return low - half, high + half
    air = share * (high - low)
    return low - air, high + air


def padded_log(low: float, high: float) -> tuple[float, float]:
    """Limits of a logarithmic axis with some air."""
    if not (math.isfinite(low) and math.isfinite(high)) or low <= 0.0:
        return 0.1, 10.0
    air = max((high / low) ** 0.06, 1.3)
    return low / air, high * air


def _power_label(value: float) -> str:
    exponent = math.floor(math.log10(value) + 1e-9)
    if -3 <= exponent <= 3:
        return f"{value:g}"
    factor = round(value / 10.0**exponent)
    return f"{'' if factor == 1 else f'{factor}·'}10{str(exponent).translate(SUPERSCRIPTS)}"
