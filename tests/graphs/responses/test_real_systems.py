# SPDX-License-Identifier: BSD-3-Clause
"""Response matrices of real systems that others recorded: a motor bench and a piezo mirror."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointscope.graphs.responses.find_excitation import find_excitation
from jointscope.graphs.responses.measured_response import MeasuredResponse
from jointscope.graphs.responses.response_matrix import response_matrix
from jointscope.graphs.responses.spectra import spectra
from jointscope.robots.recordings.signals import Signal, Signals

REAL = Path(__file__).resolve().parents[3].parent / "shared" / "data" / "real"
BENCH, MIRROR = REAL / "two_mass_multisine", REAL / "fine_steering_mirror" / "fine_steering_mirror.npz"


def bench(letter):
    z = np.load(BENCH / f"two_mass_multisine_{letter}.npz")
    t = np.arange(len(z["iq_adx"].ravel())) / float(z["rate_hz"])
    current, drive = (Signal(t, z[name].reshape(-1, 1).astype(float), ("current",)) for name in ("iq_adx", "iq_refx"))
    speeds = np.stack([z["omega_max"].ravel(), -z["omega_may"].ravel()], axis=1).astype(float)
    signals = Signals(letter, "", current, Signal(t, speeds, ("motor", "load")))
    return MeasuredResponse.of(signals, find_excitation(drive, 1, letter))


@pytest.mark.skipif(not BENCH.is_dir(), reason="shared/data/real is not beside the project")
def test_the_bench_has_its_anti_resonance_and_its_resonance_with_sigmas():
    found = bench("A")
    assert found.spectra.excitation.f0 == pytest.approx(1.0) and found.spectra.periods == 20
    of_motor = {r.anti: r for r in found.resonances if r.output == 0}
    assert of_motor[True].frequency == pytest.approx(53.5, abs=1.0) and of_motor[True].frequency_sigma < 0.5
    assert of_motor[False].frequency == pytest.approx(76.0, abs=1.0) and of_motor[False].frequency_sigma < 0.5


@pytest.mark.skipif(not BENCH.is_dir(), reason="shared/data/real is not beside the project")
def test_the_bench_shows_distortions_on_lines_that_were_not_excited():
    found = bench("B")
    d = found.distortions
    assert len(d.even.frequencies) == 118 and len(d.odd.frequencies) == 59
    low = d.odd.frequencies < 60.0
    assert np.mean(d.odd.size[low]) > 1.2 * np.mean(d.noise.size[d.noise.frequencies < 60.0])


@pytest.mark.skipif(not MIRROR.is_file(), reason="shared/data/real is not beside the project")
def test_noise_and_distortion_of_the_mirror_are_told_apart_and_its_response_predicts():
    z = np.load(MIRROR)
    u, y = (z[f"{name}_300mV_train"].transpose(2, 3, 0, 1).reshape(-1, 3) for name in "uy")
    t = np.arange(len(u)) / float(z["rate_hz"])
    signals = Signals("mirror", "", Signal(t, u, ("a", "b", "c")), Signal(t, y, ("x", "y", "z")))
    excitation = find_excitation(signals.inputs, 3, "mirror")
    assert len(excitation.lines) == 3839 and len(excitation.experiments) == 6
    matrix = response_matrix(spectra(signals, excitation))
    # noise is that of the mean of two blocks of two periods, half of what two periods of one block differ by / sqrt(2)
    periods = 100.0 * np.sqrt(8.0) * matrix.relative(matrix.noise)
    blocks = 100.0 * np.median(np.abs(matrix.each[0] - matrix.each[1]) / np.abs(matrix.G), axis=0)
    assert 0.3 < np.median(periods) < 1.0
    assert 4.0 < blocks.min() and blocks.max() < 10.5
    U, Y = (np.fft.rfft(z[f"{name}_300mV_test"].mean(axis=3), axis=0)[excitation.lines] for name in "uy")
    miss = np.linalg.norm(np.einsum("lij,ljr->lir", matrix.G, U) - Y) / np.linalg.norm(Y)
    assert miss < 0.0563  # published for a linear model of order 28
