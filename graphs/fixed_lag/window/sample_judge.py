# SPDX-License-Identifier: BSD-3-Clause
"""Holds samples against what was expected of them: which channels to use, and the innovations to tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from jointscope.graphs.fixed_lag.window.innovation import Innovation
from jointscope.graphs.fixed_lag.window.observation import Observation, ObservedRows
from jointscope.graphs.fixed_lag.window.outlier_gate import Far, OutlierGate

Array = NDArray[np.float64]


class SampleJudge:
    """Innovations of all samples.

    Args:
        channels: names of the channels of each sensor.
    """

    def __init__(self, channels: Mapping[str, tuple[str, ...]]):
        self._channels, self._gate = channels, OutlierGate()

    @property
    def memory(self) -> Far:
        """Channels that are far away now."""
        return dict(self._gate.far)

    def go_back_to(self, memory: Far) -> None:
        """Forgets what was judged since `memory` was told."""
        self._gate.far = dict(memory)

    def judged(
        self, observations: Sequence[Observation], seen: ObservedRows, S: Array
    ) -> tuple[NDArray[np.bool_], list[Innovation]]:
        """Rows to use, shape (r,), and the innovations.

        Args:
            observations: samples.
            seen: their rows.
            S: covariance of the residuals, shape (r, r).
        """
        sigma = np.sqrt(S.diagonal())
        keep = self._gate.believed(observations, seen.residual, sigma)
        innovations = []
        whole = bool(keep.all())
        for o, part in zip(observations, seen.parts, strict=True):
            if whole:
                own = S[part, part]
                innovations.append(self._innovation(o, o.channels, seen.residual[part], own, sigma[part], True))
                continue
            good = keep[part]
            for chosen, used in ((good, True), (~good, False)):
                if chosen.any():
                    rows = np.arange(part.start, part.stop)[chosen]
                    own = S[np.ix_(rows, rows)]
                    found = self._innovation(o, o.channels[chosen], seen.residual[rows], own, sigma[rows], used)
                    innovations.append(found)
        return keep, innovations

    def _innovation(
        self, o: Observation, channels: NDArray[np.intp], residual: Array, own: Array, sigma: Array, used: bool
    ) -> Innovation:
        nis = float(residual @ lapack.dposv(own, residual)[1])
        names = self._channels[o.sensor]
        if len(channels) < len(names):
            names = tuple(names[c] for c in channels.tolist())
        return Innovation(o.sensor, o.stamp, names, residual, sigma, nis, len(residual), used)
