# SPDX-License-Identifier: BSD-3-Clause
"""At which frequencies a torque is missing: amplitude spectral density by averaged periodograms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

Array = NDArray[np.float64]

SEGMENT = 2.0  # [s] resolves half a hertz
POINTS = 160  # on the logarithmic axis


def torque_spectrum(times: Array, torque: Array) -> tuple[Array, Array]:
    """Spectral density of each column.

    Args:
        times: shape (m,) [s]; uneven ones are resampled.
        torque: shape (m, c) [N m].

    Returns:
        Frequencies, shape (k,) [Hz], and densities, shape (k, c) [N m/√Hz], averaged in even steps of log f.
    """
    if len(times) < 16:
        return np.zeros(0), np.zeros((0, torque.shape[1]))
    step = float(np.median(np.diff(times)))
    even = np.arange(times[0], times[-1], step)
    values = np.column_stack([np.interp(even, times, column) for column in torque.T])
    length = min(len(even), max(round(SEGMENT / step), 16))
    f, power = welch(values, 1.0 / step, nperseg=length, axis=0)
    return _averaged(f[1:], power[1:])


def _averaged(f: Array, power: Array) -> tuple[Array, Array]:
    edges = np.geomspace(f[0] * 0.999, f[-1] * 1.001, POINTS + 1)
    place = np.digitize(f, edges) - 1
    bins = np.unique(place)
    frequency = np.array([float(np.mean(f[place == k])) for k in bins])
    return frequency, np.sqrt(np.array([np.mean(power[place == k], axis=0) for k in bins]))
