# SPDX-License-Identifier: BSD-3-Clause
"""Systems under multisines, sample by sample with scipy.signal: what a bag of them would hold."""

from __future__ import annotations

import numpy as np
from scipy import signal

from jointscope.robots.recordings.signals import Excitation, Experiment, Signal, Signals

RATE, N, PERIODS, SETTLING = 200.0, 400, 3, 4  # [Hz], samples of a period, kept periods, those before
TWO_BY_TWO = signal.StateSpace(
    np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-900, 400, -1.5, 0.5], [300, -2500, 0.4, -2.0]]),
    np.array([[0, 0], [0, 0], [1, 0], [0.2, 2]]),
    np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0]]),
    np.zeros((2, 2)),
).to_discrete(1.0 / RATE)
"""Two masses and two springs: input and output each two channels."""


def multisine(lines, rng, channels, periods):
    """Random-phase multisine of amplitude 1 for each channel, shape (periods N, channels)."""
    t = np.arange(N)
    phases = rng.uniform(0.0, 2.0 * np.pi, (len(lines), channels))
    one = np.cos(2.0 * np.pi * np.outer(t, lines)[:, :, None] / N + phases).sum(axis=1)
    return np.tile(one, (periods, 1))


def recorded(respond, lines, channels, realisations, seed=0, sigma=0.0, pairs=False, gap=0.5):
    """Signals of orthogonal experiments, one after the other with a gap, and what excited them."""
    rng = np.random.default_rng(seed)
    H = np.array([[1.0]]) if channels == 1 else np.array([[1.0, 1.0], [1.0, -1.0]])
    times, us, ys, experiments, start = [], [], [], [], 0.0
    for r in range(realisations):
        base = multisine(lines, rng, channels, PERIODS + SETTLING)
        for e in range(channels):
            for sign in (1, -1) if pairs else (1,):
                u = sign * base * H[e]
                y = respond(u)
                kept = slice(SETTLING * N, None)
                us.append(u[kept])
                ys.append(y[kept] + sigma * rng.standard_normal(y[kept].shape))
                times.append(start + np.arange(PERIODS * N) / RATE)
                experiments.append(Experiment(r, e, sign, start, PERIODS))
                start += PERIODS * N / RATE + gap
    t, names = np.concatenate(times), [f"c{i}" for i in range(channels)]
    signals = Signals(
        "made",
        "",
        Signal(t, np.vstack(us), tuple(names)),
        Signal(t, np.vstack(ys), tuple(f"y{i}" for i in range(channels))),
    )
    return signals, Excitation(RATE / N, np.asarray(lines, dtype=np.intp), tuple(experiments))


def two_by_two(u):
    """The response of the linear system, sample by sample."""
    return signal.dlsim(TWO_BY_TWO, u)[1]


def true_response(frequencies):
    """Of the sampled system, by its state space, shape (l, 2, 2)."""
    z = np.exp(2j * np.pi * np.asarray(frequencies) / RATE)
    A, B, C = TWO_BY_TWO.A, TWO_BY_TWO.B, TWO_BY_TWO.C
    return np.array([C @ np.linalg.solve(s * np.eye(4) - A, B) for s in z])
