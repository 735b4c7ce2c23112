# SPDX-License-Identifier: BSD-3-Clause
"""Periods in which a response has not settled are left out, steady ones are not, and what is left is the truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ringing_masses import LOAD, MOTOR, SPRING, ringing

from jointscope.graphs.responses.find_excitation import find_excitation
from jointscope.graphs.responses.measured_response import MeasuredResponse
from jointscope.graphs.responses.settled_periods import settled
from jointscope.robots.recordings.signals import Excitation, Experiment, Signal, Signals

BENCH = Path(__file__).resolve().parents[3].parent / "shared" / "data" / "real" / "two_mass_multisine"
LINES = np.arange(1, 400, 2)


def test_a_period_that_rings_is_left_out_and_noise_is_that_of_the_sensor():
    signals = ringing(LINES)
    found = find_excitation(signals.inputs, 1, "made")
    before = MeasuredResponse.of(signals, found).matrix
    excitation = settled(signals, found)
    assert [e.transient for e in excitation.experiments] == [1, 1, 1]
    response = MeasuredResponse.of(signals, excitation)
    assert before.relative(before.noise)[0, 0] > 0.1 > 50 * response.matrix.relative(response.matrix.noise)[0, 0]
    resonance = next(r for r in response.resonances if not r.anti)
    anti = next(r for r in response.resonances if r.anti)
    true = np.sqrt(SPRING * np.array([1.0 / LOAD, 1.0 / MOTOR + 1.0 / LOAD])) / (2 * np.pi)
    assert [anti.frequency, resonance.frequency] == pytest.approx(true.tolist(), rel=5e-3)


@pytest.mark.parametrize("seed", range(5))
def test_what_dies_out_by_a_seventh_in_a_period_is_left_out_until_two_are_left(seed):
    """Its power is at a few lines, which alone are no proof; the true response is a delay of three samples."""
    rng, t, lines = np.random.default_rng(seed), np.arange(5 * 1000) / 500.0, np.arange(1, 400, 2)
    u = np.cos(np.pi * np.outer(t, lines) + rng.uniform(0.0, 2 * np.pi, len(lines))).sum(axis=1) / 10.0
    y = np.roll(u, 3) + 2.0 * np.exp(-t) + 1e-6 * rng.standard_normal(5000)
    signals = Signals("made", "", Signal(t, u[:, None], ("u",)), Signal(t, y[:, None], ("y",)))
    excitation = Excitation(0.5, lines, (Experiment(0, 0, 1, 0.0, 5),))
    found = settled(signals, excitation)
    assert [e.transient for e in found.experiments] == [3]
    true = np.exp(-2j * np.pi * 0.5 * found.lines * 3 / 500.0)
    off = [np.abs(MeasuredResponse.of(signals, e).matrix.G[:, 0, 0] - true) for e in (excitation, found)]
    assert np.median(off[1]) < 0.1 * np.median(off[0])


@pytest.mark.parametrize("lines", [LINES, np.array([7, 31])], ids=["many lines", "two lines"])
def test_steady_periods_stay(lines):
    """Periodic from the first sample on, with noise of any size: none of a hundred recordings loses a period."""
    t = np.arange(4 * 200) / 100.0
    excitation = Excitation(0.5, lines[lines < 100], (Experiment(0, 0, 1, 0.0, 4),))
    for seed in range(100):
        rng = np.random.default_rng(seed)
        u = np.tile(rng.standard_normal(200), 4)
        y = np.convolve(np.tile(u, 2), [1.0, 0.6, 0.2])[800:1600] + rng.standard_normal(800) * 10.0 ** rng.uniform(
            -6, 1
        )
        signals = Signals("made", "", Signal(t, u[:, None], ("u",)), Signal(t, y[:, None], ("y",)))
        assert settled(signals, excitation).experiments[0].transient == 0, seed


def test_two_periods_are_kept():
    signals = ringing(LINES, realisations=1, periods=2)
    excitation = settled(signals, find_excitation(signals.inputs, 1, "made"))
    assert [e.transient for e in excitation.experiments] == [0]


@pytest.mark.skipif(not BENCH.is_dir(), reason="shared/data/real is not beside the project")
def test_a_bench_that_was_recorded_steady_keeps_its_periods():
    z = np.load(BENCH / "two_mass_multisine_A.npz")
    t = np.arange(len(z["iq_adx"].ravel())) / float(z["rate_hz"])
    current, speed = (Signal(t, z[n].reshape(-1, 1).astype(float), (n,)) for n in ("iq_adx", "omega_max"))
    drive = Signal(t, z["iq_refx"].reshape(-1, 1).astype(float), ("current",))
    excitation = settled(Signals("A", "", current, speed), find_excitation(drive, 1, "A"))
    assert all(e.transient <= 1 for e in excitation.experiments)


@pytest.mark.skipif(not BENCH.is_dir(), reason="shared/data/real is not beside the project")
def test_the_lines_of_a_measured_current_are_those_that_were_excited():
    z = np.load(BENCH / "two_mass_multisine_A.npz")
    current = z["iq_adx"].reshape(-1, 1).astype(float)[:25000]
    found = find_excitation(Signal(np.arange(len(current)) / float(z["rate_hz"]), current, ("current",)), 1, "A")
    np.testing.assert_array_equal(found.lines, np.arange(11, 251))
