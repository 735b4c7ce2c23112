# SPDX-License-Identifier: BSD-3-Clause
"""Positions and velocities straight from an encoder: where a calibration begins.

A fine and fast encoder is differentiated over a few milliseconds. Where the noise of that slope would hide which way a
joint turns, as with coarse counts or few samples a second, each joint gets the widest window over which a parabola
still fits its samples to their sigma; between samples a cubic joins the parabolas.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.signal import savgol_filter

from jointscope.robots.parts.sensors import LinkEncoder, MotorEncoder
from jointscope.robots.recordings.recording import Stream

Array = NDArray[np.float64]

SMOOTHING = 0.008  # [s] window over which a fine encoder is differentiated
ROUGH = 0.02  # [rad/s] noise of a velocity that hides the sign of friction, whose law turns over within 0.01
WIDEST = 0.4  # [s]
FITS = 1.1  # [sigma] mean residual of a parabola that is explained by noise


def encoder_motion(stream: Stream, encoder: MotorEncoder | LinkEncoder, ticks: Array) -> tuple[Array, Array]:
    """Positions and velocities at ticks, shape (m, n) each [rad, of joints that slide m]."""
    own = [stream.channel(j) for j in range(stream.values.shape[1])]  # each joint may have a driver of its own
    if np.all(stream.periods <= SMOOTHING / 4.0) and not hides_reversals(stream, encoder):
        q = np.column_stack([np.interp(ticks, joint.times, joint.values[:, 0]) for joint in own]) - encoder.zero
        return q, smooth_slope(q, ticks)
    found = []
    for joint, period, zero, sigma in zip(own, stream.periods, encoder.zero, encoder.sigmas, strict=True):
        grid = np.arange(joint.times[0], joint.times[-1] + 0.5 * period, period)
        q, v = _widest_parabolas(np.interp(grid, joint.times, joint.values[:, 0]) - zero, period, float(sigma))
        spline = CubicHermiteSpline(grid, q, v)
        inside = np.clip(ticks, grid[0], grid[-1])
        found.append((spline(inside), spline(inside, 1)))
    return np.column_stack([q for q, _ in found]), np.column_stack([v for _, v in found])


def hides_reversals(stream: Stream, encoder: MotorEncoder | LinkEncoder) -> bool:
    """Whether slopes over SMOOTHING, or over three samples where these take longer, are lost in noise."""
    return bool(np.any(slope_noise(stream, encoder.sigmas) > ROUGH))


def slope_noise(stream: Stream, sigmas: Array) -> Array:
    """Noise of slopes over SMOOTHING, or over three samples where these take longer, shape (n,) [rad/s].

    Args:
        stream: of the encoder, with n channels.
        sigmas: of the encoder, shape (n,) [rad].
    """
    window = np.maximum(SMOOTHING, 2.0 * stream.periods)
    return np.asarray(sigmas * np.sqrt(12.0 * stream.periods / window) / window)


def smooth_slope(values: Array, ticks: Array) -> Array:
    """Slope of a local parabola; polynomial at the ends, so that nothing jumps there."""
    h = float(np.median(np.diff(ticks)))
    width = min(2 * max(round(0.5 * SMOOTHING / h), 1) + 1, len(ticks) - 1 + len(ticks) % 2)
    if width < 3:
        return np.asarray(np.gradient(values, ticks, axis=0), dtype=np.float64)
    return np.asarray(savgol_filter(values, width, 2, deriv=1, delta=h, axis=0, mode="interp"), dtype=np.float64)


def _widest_parabolas(values: Array, period: float, sigma: float) -> tuple[Array, Array]:
    """Smoothed samples and slopes; windows grow by half as long as what they leave looks like noise."""
    if len(values) < 5:
        return values, np.gradient(values, period) if len(values) > 1 else 0.0 * values
    width, best = 3, 3
    while width <= min(len(values), WIDEST / period):
        left = savgol_filter(values, width, 2, mode="interp") - values
        freedom = max(1.0 - 2.25 / width, 1e-9) if width > 3 else 1.0
        if np.mean(left**2) > freedom * (FITS * sigma) ** 2:
            break
        best, width = width, width + 2 * max(width // 4, 1)
    q, v = (savgol_filter(values, best, 2, deriv=d, delta=period, mode="interp") for d in (0, 1))
    return np.asarray(q, dtype=np.float64), np.asarray(v, dtype=np.float64)
