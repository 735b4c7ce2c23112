# SPDX-License-Identifier: BSD-3-Clause
"""Orthogonal random-phase multisines in pairs of both signs, and the schedule of their experiments.

Input i in experiment e of a realisation gets its multisine turned by exp(2 pi j i e / n): over n experiments the inputs
of a line are a unitary matrix (Dobrowiecki and Schoukens, 2007).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.signals import Excitation, Experiment
from jointscope.tools.simulator.world.random_streams import random_stream

Array = NDArray[np.float64]
CARRIER = 3  # line of the motion that carries the excitation: odd, so that what it mixes falls on even lines


@dataclass(frozen=True)
class Multisine:
    """What shakes an arm.

    Attributes:
        f0: distance of the lines [Hz].
        lines: odd multiples of f0, shape (l,).
        amplitude: of each line of each input, shape (n,) [N m].
        phases: of each realisation, input and line, shape (r, n, l) [rad].
    """

    f0: float
    lines: NDArray[np.intp]
    amplitude: Array
    phases: Array

    @staticmethod
    def drawn(f0: float, highest: float, rms: Array, realisations: int, seed: int, session: str) -> Multisine:
        """Random phases.

        Args:
            f0: distance of the lines [Hz].
            highest: no line is above it [Hz].
            rms: of the torques, shape (n,) [N m].
            realisations: how many.
            seed: of the arm.
            session: of the recordings.
        """
        lines = np.arange(1, round(highest / f0) + 1, 2)
        size = (realisations, len(rms), len(lines))
        phases = random_stream(seed, session, "phases").uniform(0.0, 2.0 * np.pi, size)
        return Multisine(f0, lines, rms * np.sqrt(2.0 / len(lines)), phases)

    def torque(self, realisation: int, experiment: int, sign: int, step: float) -> Array:
        """One period, shape (m, n) [N m], sampled every `step` [s]."""
        count, n = round(1.0 / (self.f0 * step)), len(self.amplitude)
        spectrum = np.zeros((count // 2 + 1, n), dtype=complex)
        turned = self.phases[realisation] + 2.0 * np.pi * experiment * np.arange(n)[:, None] / n
        spectrum[self.lines] = (sign * self.amplitude[:, None] * np.exp(1j * turned)).T
        return np.asarray(np.fft.irfft(0.5 * count * spectrum, count, axis=0))

    def excitation(self, periods: int, between: float, settle: int = 0, carrier: int = CARRIER) -> Excitation:
        """All experiments of one pose one after another, each with both signs.

        Args:
            periods: that are kept of each.
            between: from the end of one to the begin of the next [s].
            settle: periods before those that are kept, which are recorded, too.
            carrier: line of the motion that carries the excitation; 0 for none.
        """
        count, n, _ = self.phases.shape
        each = [(r, e, sign) for r in range(count) for e in range(n) for sign in (1, -1)]
        apart = (settle + periods) / self.f0 + between
        rows = tuple(Experiment(*key, k * apart, settle + periods, settle) for k, key in enumerate(each))
        return Excitation(self.f0, self.lines, rows, carrier * self.f0, "the simulator")
