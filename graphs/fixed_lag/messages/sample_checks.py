# SPDX-License-Identifier: BSD-3-Clause
"""What is looked at before a sample is used: finite, not a repetition, not stuck, how coarse its encoder is."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

CERTAIN = 1e-6  # probability of as many equal samples in a row by chance, below which a channel is saturated or dead
FEWEST_EQUAL, MOST_EQUAL = 2, 20  # samples that repeat the one before
MEMORY = 0.01  # weight of a new sample in the share of those that repeat the one before
COARSE = 1.0  # [sigma] an encoder whose smallest change is larger is quantized; see graphs/problem/coarse_encoder.py
SMOOTHING = 50  # samples over which its speed is averaged
MOST = 100.0  # samples that may share one error
SMALLEST_CHANGE = 1e-12  # [unit] differences below this are rounding
STAMPS = 4096  # stamps remembered against repetitions


class SampleChecks:
    """Checks of one stream.

    Args:
        sigmas: standard deviation of each channel of a sample; zeros for commands.
        noisy: whether equal samples in a row are impossible (a gyro).
    """

    def __init__(self, sigmas: Sequence[float], noisy: bool):
        self._sigmas, self._noisy, channels = tuple(sigmas), noisy, len(sigmas)
        self._stamps: set[float] = set()
        self._order: deque[float] = deque()
        self._last: list[float] = [float("nan")] * channels
        self._equal = [0] * channels
        self._looked_at = 0
        self._repeats = [0.5] * channels
        self._step = [float("inf")] * channels
        self._recent: deque[tuple[float, list[float], list[int]]] = deque(maxlen=SMOOTHING + 1)
        self._samples = [0] * channels

    def is_duplicate(self, t: float) -> bool:
        """Whether a sample with this stamp came before; remembers it."""
        if t in self._stamps:
            return True
        self._stamps.add(t)
        self._order.append(t)
        if len(self._order) > STAMPS:
            self._stamps.discard(self._order.popleft())
        return False

    def forget(self) -> None:
        """Forgets all stamps: the clock was set."""
        self._stamps.clear()
        self._order.clear()
        self._recent.clear()

    def stuck(self, values: list[float]) -> list[int]:
        """Channels that repeat one value although they have noise."""
        if not self._noisy:
            return []
        found = []
        self._looked_at += 1
        share = max(1.0 / (self._looked_at + 1), MEMORY)
        for j, value in enumerate(values):
            if value == self._last[j]:
                self._equal[j] += 1
                if self._equal[j] <= FEWEST_EQUAL:
                    self._repeats[j] += share * (1.0 - self._repeats[j])
                if self._equal[j] >= FEWEST_EQUAL and self._equal[j] >= self._patience(j):
                    found.append(j)
                continue
            self._equal[j] = 0
            self._repeats[j] -= share * self._repeats[j]
        self._last = values
        return found

    def _patience(self, channel: int) -> float:
        """How many equal samples in a row a channel may give, from how often it has repeated itself."""
        enough = math.log(CERTAIN) / math.log(min(max(self._repeats[channel], 1e-3), 0.5))
        return min(max(enough, FEWEST_EQUAL), MOST_EQUAL)

    def shared_error(self, t: float, values: list[float]) -> list[float] | None:
        """Factor on the sigma of each channel: samples of a quantized encoder share errors in slow motion.

        NaN stands for a channel that was not measured, and is taken as a repetition.
        """
        if not self._recent or t > self._recent[0][0]:
            self._samples = [n + (not math.isnan(value)) for n, value in zip(self._samples, values, strict=True)]
        if any(math.isnan(value) for value in values):
            if not self._recent:
                return None
            values = [last if math.isnan(new) else new for new, last in zip(values, self._recent[-1][1], strict=True)]
        if not self._recent:
            self._recent.append((t, values, self._samples))
            return None
        before_t, before, _ = self._recent[-1]
        for j, value in enumerate(values):
            change = abs(value - before[j])
            if SMALLEST_CHANGE < change < self._step[j]:
                self._step[j] = change
        if t > before_t:
            self._recent.append((t, values, self._samples))
        enough = len(self._recent) > SMOOTHING
        # a reading that has never changed repeats one error, however large the encoder's step is
        coarse = [
            step > COARSE * sigma and (enough or math.isinf(step))
            for step, sigma in zip(self._step, self._sigmas, strict=True)
        ]
        if not any(coarse):
            return None
        _, first, begin = self._recent[0]
        # each channel's own samples, with those that came late; other nodes on the topic do not count
        counts = [max(n - past, 1) for n, past in zip(self._samples, begin, strict=True)]
        # samples that share one error: a step over the way from one sample to the next
        ways = [abs(value - start) / n for value, start, n in zip(values, first, counts, strict=True)]
        return [
            math.sqrt(min(max(step / max(way, SMALLEST_CHANGE), 1.0), MOST)) if is_coarse else 1.0
            for step, way, is_coarse in zip(self._step, ways, coarse, strict=True)
        ]
