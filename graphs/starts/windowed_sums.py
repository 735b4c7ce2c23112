# SPDX-License-Identifier: BSD-3-Clause
"""Products of windowed signals, summed block by block: all that a regression with block-robust sigmas needs.

Every row of the regression is the mean of the equation of motion under one smooth window. Smooth windows are the
filter: with them a mean acceleration is a mean of positions, and noise of the encoders is averaged away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from jointscope.graphs.starts.motion_cells import MotionCells

Array = NDArray[np.float64]

SIGNALS = ("command", "load", "viscous", "dry", "inertia")
"""What the products are of: u, M a + c + g, v, sign(v) and a of one joint."""
WIDTHS = (0.06, 0.12, 0.24, 0.48, 0.96)  # [s] of windows that are tried
FEWEST_CELLS, CELLS = 12, 96  # in a window, so that it is smooth, and those that are enough
PER_WINDOW = 4  # windows begin at every quarter
BLOCKS = 20  # of the recording at the most, each at least
BLOCK = 1.0  # [windows] long, so that blocks share little


@dataclass(frozen=True)
class WindowedSums:
    """Sums over the windows of one joint.

    Attributes:
        width: of the windows [s].
        products: sums of products of the signals of each block, shape (b, 5, 5).
        counts: windows in each block, shape (b,).
        noise: part of the products that the encoder's noise makes in each window, shape (5, 5).
    """

    width: float
    products: Array
    counts: Array
    noise: Array

    def __add__(self, other: WindowedSums) -> WindowedSums:
        """The blocks of both; of the same width."""
        products, counts = np.concatenate([self.products, other.products]), np.append(self.counts, other.counts)
        share = self.counts.sum() / max(counts.sum(), 1.0)
        return WindowedSums(self.width, products, counts, share * self.noise + (1.0 - share) * other.noise)

    @property
    def total(self) -> Array:
        """Products of all windows, shape (5, 5)."""
        return np.asarray(self.products.sum(axis=0))


def joint_signals(cells: MotionCells, load: Array, sharpness: float | Array) -> Array:
    """The signals of all cells and joints, shape (m, n, 5).

    Args:
        cells: motion and commands.
        load: torques M a + c + g, shape (m, n) [N m].
        sharpness: k in tanh(k v) [s/rad].
    """
    return np.stack([cells.u, load, cells.v, _mean_sign(cells.v_smooth, sharpness), cells.a], axis=2)


def smooth_window(length: int) -> Array:
    """A window that begins and ends at zero and has a mean of one, shape (length,)."""
    return np.asarray(1.0 - np.cos(2.0 * np.pi * (np.arange(length) + 0.5) / length))


def windowed_sums(cells: MotionCells, signals: Array, noise: Array, width: float) -> list[WindowedSums]:
    """Sums of every joint.

    Args:
        cells: motion and commands.
        signals: of all cells, shape (m, n, 5).
        noise: variance of white noise on positions as it enters load and inertia, shape (n, 3): load^2, load times
            inertia, inertia^2 [rad^2].
        width: of the windows [s].
    """
    found = []
    rows_of_joints, length = windowed_rows(cells, signals, width)
    for j, (rows, block, count) in enumerate(rows_of_joints):
        counts = np.bincount(block, minlength=count).astype(float)
        products = np.stack([part.T @ part for part in np.split(rows, np.cumsum(counts[:-1]).astype(int))])
        velocity, acceleration = noise_gains(float(cells.periods[j]), length)
        of_noise = np.zeros((5, 5))
        of_noise[1, 1], of_noise[1, 4], of_noise[4, 4] = acceleration * noise[j]
        of_noise[4, 1], of_noise[2, 2] = of_noise[1, 4], velocity * noise[j, 2]
        found.append(WindowedSums(width, products[counts > 0], counts[counts > 0], of_noise))
    if not found:
        return [
            WindowedSums(width, np.zeros((0, 5, 5)), np.zeros(0), np.zeros((5, 5))) for _ in range(signals.shape[1])
        ]
    return found


def windowed_rows(
    cells: MotionCells, signals: Array, width: float
) -> tuple[list[tuple[Array, NDArray[np.intp], int]], float]:
    """Means of signals under every window.

    Args:
        cells: motion and commands.
        signals: of all cells, shape (m, n, k).
        width: of the windows [s].

    Returns:
        For each joint the rows, shape (w, k), the block of each, shape (w,), and how many blocks there are; nothing
        where the recording is shorter than a window. Then the length of a window [s].
    """
    together, length = window_cells(cells, width)
    signals, known, h = _coarser(signals, cells, together)
    m, n = signals.shape[:2]
    if length > m:
        return [], length * h
    window = smooth_window(length)
    starts = np.arange(0, m - length + 1, max(length // PER_WINDOW, 1))
    unknown = np.vstack([np.zeros((1, n), int), np.cumsum(~known, axis=0)])
    usable = unknown[starts + length] == unknown[starts]
    count = int(np.clip(m * h / (BLOCK * width), 2, BLOCKS))
    block = np.minimum(starts * count // max(m - length + 1, 1), count - 1)
    found = []
    for j in range(n):
        good = sliding_window_view(signals[:, j], length, axis=0)[starts[usable[:, j]]] @ (window / length)
        found.append((np.asarray(good), block[usable[:, j]], count))
    return found, length * h


def window_cells(cells: MotionCells, width: float) -> tuple[int, int]:
    """How many cells are taken together, and how many of these make a window of some width [s]."""
    together = max(round(width / cells.h) // CELLS, 1)
    return together, max(round(width / (together * cells.h)), FEWEST_CELLS)


def _coarser(signals: Array, cells: MotionCells, count: int) -> tuple[Array, NDArray[np.bool_], float]:
    """Signals of so many cells in one, which of them are known, and their length [s]; means of means are means."""
    m = len(signals) // count * count
    known = np.all(cells.known[:m].reshape(-1, count, cells.known.shape[1]), axis=1)
    means = signals[:m].reshape(-1, count, *signals.shape[1:]).mean(axis=1)
    return means, np.asarray(known, dtype=np.bool_), count * cells.h


def noise_gains(period: float, width: float) -> tuple[float, float]:
    """Variance of a windowed velocity and acceleration per variance of a position that is sampled at every period."""
    omega = 2.0 * np.pi / width
    return period * omega**2 / (2.0 * width), period * omega**4 / (2.0 * width)


def _mean_sign(v: Array, sharpness: float | Array) -> Array:
    """Mean of tanh(k v) over cells in which v goes from one edge's value to the next one's, shape (m, n)."""
    x = sharpness * v
    log_cosh = np.abs(x) + np.log1p(np.exp(-2.0 * np.abs(x)))
    change, middle = np.diff(x, axis=0), 0.5 * (x[1:] + x[:-1])
    still = np.abs(change) < 1e-6
    return np.where(still, np.tanh(middle), np.diff(log_cosh, axis=0) / np.where(still, 1.0, change))
