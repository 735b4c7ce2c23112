# SPDX-License-Identifier: BSD-3-Clause
"""Two masses on a spring that begin at rest, stepped by their exact discrete equations: steady only after a period."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from jointscope.robots.recordings.signals import Signal, Signals

RATE, N = 1000, 2000  # [Hz], samples of a period
MOTOR, LOAD, SPRING, DAMPER, FRICTION = 1.5, 0.8, 6000.0, 4.0, 20.0


def ringing(lines, realisations=3, periods=4, noise=1e-7, seed=0, every=1):
    """Torque and position of the motor, a multisine of other phases after the other.

    Args:
        lines: that are excited, in multiples of half a hertz.
        realisations, periods: of each.
        noise: of the position [rad].
        seed: of phases and noise.
        every: of so many samples one is kept.
    """
    k, c, d = SPRING, DAMPER, FRICTION
    rates = np.zeros((5, 5))
    rates[0, 2] = rates[1, 3] = 1.0
    rates[2] = np.array([-k, k, -(c + d), c, 1.0]) / MOTOR
    rates[3] = np.array([k, -k, c, -c, 0.0]) / LOAD
    step = expm(rates / RATE)
    rng, t = np.random.default_rng(seed), np.arange(N) / RATE
    waves = 2 * np.pi * RATE / N * np.outer(t, lines)
    u = [
        np.tile(np.cos(waves + rng.uniform(0, 2 * np.pi, len(lines))).sum(axis=1), periods) for _ in range(realisations)
    ]
    u = np.concatenate(u)
    x, y = np.zeros(5), np.zeros(len(u))
    for i, torque in enumerate(u):
        x[4], y[i] = torque, x[0]
        x = step @ x
    y += noise * rng.standard_normal(len(y))
    times = np.arange(len(u)) / RATE
    torque, position = (Signal(times[::every], v[::every, None], ("motor",)) for v in (u, y))
    return Signals("made", "", torque, position)
