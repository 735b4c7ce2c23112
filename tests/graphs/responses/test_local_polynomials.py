# SPDX-License-Identifier: BSD-3-Clause
"""Responses of short records without whole periods: systems whose response is known, with their transients."""

from __future__ import annotations

import numpy as np
import pytest
from periodic_systems import RATE, multisine, true_response, two_by_two
from scipy import signal

from jointscope.graphs.responses.find_excitation import NoPeriodsError, find_excitation
from jointscope.graphs.responses.local_polynomials import response_without_periods
from jointscope.graphs.responses.measured_response import MeasuredResponse
from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.signals import Signal, Signals

DAMPED = signal.lti([400.0], [1.0, 8.0, 400.0]).to_ss().to_discrete(1.0 / RATE)


def recording(u, y, sigma=0.0, seed=0, late=0.0):
    """Signals of a system that already moved, as it was recorded from some time on."""
    y = y + sigma * np.random.default_rng(seed).standard_normal(y.shape)
    t = 3.0 + np.arange(len(u)) / RATE
    names = [tuple(f"{letter}{i}" for i in range(x.shape[1])) for letter, x in (("u", u), ("y", y))]
    return Signals("made", "", Signal(t, u, names[0]), Signal(t + late, y, names[1]))


def damped(u):
    return signal.dlsim(DAMPED, u)[1]


def true_damped(f):
    z = np.exp(2j * np.pi * np.asarray(f) / RATE)
    return np.array([(DAMPED.C @ np.linalg.solve(s * np.eye(2) - DAMPED.A, DAMPED.B) + DAMPED.D).item() for s in z])


def noise(n, channels, seed=0):
    return np.random.default_rng(seed).standard_normal((n, channels))


def test_noise_tells_the_response_to_within_its_sigmas():
    squares, relative = [], []
    for seed in range(6):
        u = noise(2400, 1, seed)
        found = response_without_periods(recording(u[400:], damped(u)[400:], 0.02, seed))[1]
        off = found.G[:, 0, 0] - true_damped(found.frequencies)
        squares.append(np.mean(np.abs(off) ** 2 / found.total[:, 0, 0].real))
        low = found.frequencies < 8.0
        relative.append(float(np.median(np.abs(off[low]) / np.abs(true_damped(found.frequencies[low])))))
    assert 0.7 < np.mean(squares) < 1.5
    assert np.median(relative) < 0.05
    assert found.frequencies[0] < 2.0 and found.frequencies[-1] > 90.0


def test_transients_are_no_error_of_the_response():
    """Without noise nothing but the polynomials is wrong; a ratio of spectra is spoilt by where the stretch begins."""
    u = noise(2400, 1, 3)
    signals = recording(u[400:], damped(u)[400:])
    spectra, found = response_without_periods(signals)
    truth = true_damped(found.frequencies)
    ours = np.abs(found.G[:, 0, 0] / truth - 1.0)
    k = spectra.excitation.lines
    ratio = np.abs(spectra.Y[0, 0, k, 0] / spectra.U[0, 0, k, 0] / truth - 1.0)
    low = found.frequencies < 20.0
    assert np.median(ours[low]) < 0.1 * np.median(ratio[low])
    assert np.median(ours[low]) < 0.01


def test_two_inputs_at_once_are_told_apart_with_the_covariance_of_all_entries():
    u = noise(6000, 2, 5)
    found = response_without_periods(recording(u[1000:], two_by_two(u)[1000:], 1e-3))[1]
    truth = true_response(found.frequencies)
    off = (found.G - truth).reshape(len(truth), 4)
    white = np.linalg.solve(np.linalg.cholesky(found.total), off[:, :, None])[:, :, 0]
    narrow = found.frequencies < 12.0  # resonances at 4.5 and 8 Hz are as narrow as the polynomials: sigmas hold it
    assert 0.6 < np.mean(np.abs(white[~narrow]) ** 2) < 1.7
    assert np.mean(np.abs(white[narrow]) ** 2) < 3.0


def test_a_multisine_of_one_period_and_a_half_is_enough():
    rng = np.random.default_rng(0)
    lines = np.arange(1, 180, 2)
    u = multisine(lines, rng, 1, 4)[: 400 + 600]
    signals = recording(u[400:], damped(u)[400:], 1e-3)
    with pytest.raises(NoPeriodsError):
        find_excitation(signals.inputs, 1, "made")
    found = MeasuredResponse.of(signals, None)
    f = found.matrix.frequencies
    off = np.abs(found.matrix.G[:, 0, 0] / true_damped(f) - 1.0)
    assert len(f) > 20 and np.median(off[f < 20.0]) < 0.05
    assert found.distortions is None and "no whole periods" in found.spectra.excitation.source


def test_outputs_that_are_sampled_later_have_the_phase_of_their_time():
    u = noise(2400, 1, 1)
    y = damped(u)
    plain = response_without_periods(recording(u, y))[1]
    late = response_without_periods(recording(u, y, late=0.4 / RATE))[1]
    n = min(len(plain.G), len(late.G))
    turned = late.G[:n, 0, 0] / plain.G[:n, 0, 0]
    expected = np.exp(-2j * np.pi * plain.frequencies[:n] * 0.4 / RATE)
    low = plain.frequencies[:n] < 20.0
    np.testing.assert_allclose(turned[low], expected[low], atol=0.02)


def test_the_longest_stretch_without_a_gap_is_taken():
    u = noise(3000, 1, 2)
    y = damped(u)
    whole = recording(u, y)
    keep = np.r_[0:500, 600:3000]
    cut = Signals("made", "", *(Signal(s.times[keep], s.values[keep], s.names) for s in (whole.inputs, whole.outputs)))
    spectra, _ = response_without_periods(cut)
    assert 1.0 / spectra.excitation.f0 == pytest.approx(2400 / RATE, rel=0.01)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda u, y: (np.hstack([u, 2.0 * u]), y), "the inputs move together"),
        (lambda u, y: (u[:40], y[:40]), "record longer"),
    ],
)
def test_what_tells_nothing_is_refused(change, text):
    u = noise(2000, 1)
    with pytest.raises(RecordingError, match=text):
        response_without_periods(recording(*change(u, damped(u))))


def test_two_rates_are_refused():
    u = noise(2000, 1)
    made = recording(u, damped(u))
    slow = Signal(made.outputs.times[::2], made.outputs.values[::2], made.outputs.names)
    with pytest.raises(RecordingError, match="both must have one rate"):
        response_without_periods(Signals("made", "", made.inputs, slow))
