# SPDX-License-Identifier: BSD-3-Clause
"""A response that tells little says why, as far as the recording shows it; one that tells much says nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from ringing_masses import ringing

from jointscope.graphs.responses.find_excitation import find_excitation
from jointscope.graphs.responses.measured_response import MeasuredResponse
from jointscope.graphs.responses.settled_periods import settled
from jointscope.robots.recordings.signals import Excitation, Experiment, Signal, Signals
from jointscope.tools.presentation.noisy_response import buried_lines, noise_doubt
from jointscope.tools.terminal.responses_text import response_text


def measured(signals):
    return MeasuredResponse.of(signals, settled(signals, find_excitation(signals.inputs, 1, "made")))


def test_lines_above_half_the_rate_of_the_samples_are_told():
    found = measured(ringing(np.arange(1, 900, 2), every=4))
    assert "the lines go up to 124.5 Hz, half the rate of the samples" in noise_doubt(found)
    assert "Record at more than twice the highest excited frequency" in response_text(found)


def test_a_good_response_is_not_doubted():
    found = measured(ringing(np.arange(1, 240, 2), every=4))
    assert not noise_doubt(found)
    assert "without the first period of each experiment, in which the response had not settled" in response_text(found)


def test_an_output_that_is_noise_has_likely_reasons():
    said = noise_doubt(measured(ringing(np.arange(1, 240, 2), noise=1e-2)))
    assert "the output changes from period to period" in said and "half the rate" not in said


def test_an_input_below_its_noise_is_named_with_its_lines_and_its_sigma_holds_the_bias():
    """Two inputs of which noise buries the second one at the lowest lines: its responses come out too small."""
    rng, lines, N, gains = np.random.default_rng(5), np.arange(1, 60), 400, np.array([2.0, 1.0])
    t, u, y, experiments = [], [], [], []
    for r, e in np.ndindex(2, 2):
        if e == 0:
            base = np.exp(2j * np.pi * rng.random((2, len(lines)))) * N / 2
            base[1, :2] *= 0.01
        U = np.zeros((2, N // 2 + 1), dtype=complex)
        U[:, lines] = base * np.array([[1.0], [1.0 - 2.0 * e]])
        true = np.tile(np.fft.irfft(U), 2).T
        start = (2 * r + e) * 2.5 * N * 0.005
        experiments.append(Experiment(r, e, 1, start, 2))
        t.append(start + 0.005 * np.arange(2 * N))
        u.append(true + np.array([1e-3, 0.4]) * rng.standard_normal(true.shape))
        y.append((true @ gains)[:, None] + 1e-4 * rng.standard_normal((2 * N, 1)))
    times = np.concatenate(t)
    signals = Signals("made", "", Signal(times, np.vstack(u), ("a", "b")), Signal(times, np.vstack(y), ("y",)))
    found = MeasuredResponse.of(signals, Excitation(0.5, lines, tuple(experiments)))
    assert buried_lines(found).startswith("Inputs that hardly rise above their noise: b at 0.5, 1 Hz. The response")
    assert "! Inputs that hardly rise" in response_text(found) and found.to_json()["buried"] == {
        "a": [],
        "b": [0.5, 1.0],
    }
    off = np.abs(found.matrix.G - gains)[:2, 0, 1] / found.matrix.sigmas(found.matrix.total)[:2, 0, 1]
    assert np.all(off < 4.0)
    clean = replace(signals, inputs=replace(signals.inputs, values=np.vstack(u) * 0.0 + _steady(u)))
    assert not buried_lines(MeasuredResponse.of(clean, Excitation(0.5, lines, tuple(experiments))))


def _steady(u):
    """Inputs without noise but for the one that all periods share."""
    return np.vstack([np.tile((part[:400] + part[400:]) / 2, (2, 1)) for part in u])
