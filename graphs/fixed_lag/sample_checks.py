# SPDX-License-Identifier: BSD-3-Clause
"""What is looked at before a sample is used: finite, not a repetition, not stuck, how coarse its encoder is."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STUCK_AFTER = 20  # equal samples in a row of a channel with noise: it is saturated or dead
COARSE = 1.0  # [sigma] an encoder whose smallest change is larger is quantized; see graphs/coarse_encoder.py
SMOOTHING = 50  # samples over which its speed is averaged
MOST = 100.0  # samples that may share one error
SMALLEST_CHANGE = 1e-12  # [unit] differences below this are rounding
STAMPS = 4096  # stamps remembered against repetitions


class SampleChecks:
    """Checks of one stream.

    Args:
        channels: number of channels.
        sigma: standard deviation of a sample; zero for commands.
        noisy: whether equal samples in a row are impossible (a gyro).
    """

    def __init__(self, channels: int, sigma: float, noisy: bool):
        self._sigma, self._noisy = sigma, noisy
        self._stamps: set[float] = set()
        self._order: deque[float] = deque()
        self._last: Array | None = None
        self._equal = np.zeros(channels, dtype=int)
        self._step = np.full(channels, np.inf)
        self._recent: deque[tuple[float, Array]] = deque(maxlen=SMOOTHING + 1)

    def is_duplicate(self, t: float) -> bool:
        """Whether a sample with this stamp came before; remembers it."""
        if t in self._stamps:
            return True
        self._stamps.add(t)
        self._order.append(t)
        if len(self._order) > STAMPS:
            self._stamps.discard(self._order.popleft())
        return False

    def stuck(self, values: Array) -> NDArray[np.bool_]:
        """Channels that repeat one value although they have noise, shape (c,)."""
        if not self._noisy:
            return np.zeros(len(values), dtype=bool)
        if self._last is not None:
            self._equal = np.where(values == self._last, self._equal + 1, 0)
        self._last = values
        return self._equal >= STUCK_AFTER

    def shared_error(self, t: float, values: Array) -> Array | float:
        """Factor on the sigma of an encoder's sample: those of a quantized one share errors in slow motion."""
        if not self._recent:
            self._recent.append((t, values))
            return 1.0
        before_t, before = self._recent[-1]
        change = np.abs(values - before)
        self._step = np.minimum(self._step, np.where(change > SMALLEST_CHANGE, change, np.inf))
        if t > before_t:
            self._recent.append((t, values))
        if len(self._recent) <= SMOOTHING or not np.any(np.isfinite(self._step) & (self._step > COARSE * self._sigma)):
            return 1.0
        t0, first = self._recent[0]
        period = (t - t0) / SMOOTHING
        speed = np.abs(values - first) / max(t - t0, period)
        worth_one = np.clip(self._step / np.maximum(speed * period, SMALLEST_CHANGE), 1.0, MOST)
        return np.where(np.isfinite(self._step) & (self._step > COARSE * self._sigma), np.sqrt(worth_one), 1.0)
