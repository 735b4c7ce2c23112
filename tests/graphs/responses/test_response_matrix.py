# SPDX-License-Identifier: BSD-3-Clause
"""Response matrices with their covariances, distortions and resonances, of systems whose response is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from periodic_systems import RATE, N, recorded, true_response, two_by_two
from ringing_masses import ringing

from jointscope.graphs.responses.distortions import distortions
from jointscope.graphs.responses.find_excitation import find_excitation
from jointscope.graphs.responses.measured_response import MeasuredResponse
from jointscope.graphs.responses.resonances import resonances
from jointscope.graphs.responses.response_matrix import response_matrix
from jointscope.graphs.responses.spectra import spectra
from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.signals import Excitation, Experiment, Signal, Signals

LINES = np.arange(2, 120)
ODD = np.array([k for k in range(3, 120, 2) if k % 8 != 7])


def cubic(u):
    return u + 0.02 * u**3


@pytest.fixture(scope="module")
def linear():
    return recorded(two_by_two, LINES, 2, realisations=3, sigma=1e-3)


def test_a_linear_system_has_its_own_response_within_the_sigmas_of_its_noise(linear):
    matrix = response_matrix(spectra(*linear))
    miss = np.abs(matrix.G - true_response(matrix.frequencies))
    for covariance in (matrix.noise, matrix.total):
        ratio = miss / matrix.sigmas(covariance)
        assert 0.8 < np.sqrt(np.mean(ratio**2)) < 1.25
        assert ratio.max() < 5.0


def test_noise_of_a_linear_system_is_all_that_its_realisations_differ_by(linear):
    matrix = response_matrix(spectra(*linear))
    ratio = matrix.sigmas(matrix.total) / matrix.sigmas(matrix.noise)
    assert 0.85 < np.median(ratio) < 1.15


def test_distortions_are_in_the_total_and_not_in_the_noise():
    matrix = response_matrix(spectra(*recorded(cubic, ODD, 1, realisations=10, sigma=1e-3)))
    assert np.median(matrix.sigmas(matrix.total) / matrix.sigmas(matrix.noise)) > 10.0
    # the best linear approximation of u + a u^3 for K sines of amplitude 1: 1 + 3/4 a (2 K - 1)
    gain = 1.0 + 0.75 * 0.02 * (2 * len(ODD) - 1)
    assert abs(np.mean(matrix.G) - gain) < 0.02 * gain


def test_one_realisation_takes_the_scatter_of_neighbouring_lines_and_says_so(linear):
    signals, excitation = linear
    first = replace(excitation, experiments=tuple(e for e in excitation.experiments if e.realisation == 0))
    matrix = response_matrix(spectra(signals, first))
    assert "one realisation" in matrix.total_from
    ratio = matrix.sigmas(matrix.total) / matrix.sigmas(matrix.noise)
    assert 0.6 < np.median(ratio) < 1.6


def test_the_scatter_of_lines_is_not_made_larger_by_a_resonance():
    signals, excitation = recorded(two_by_two, LINES, 2, realisations=1, sigma=1e-5)
    matrix = response_matrix(spectra(signals, excitation))
    peak = np.argmax(np.abs(matrix.G[:, 0, 0]))
    assert matrix.sigmas(matrix.total)[peak, 0, 0] < 0.05 * np.abs(matrix.G[peak, 0, 0])


def test_even_distortions_show_on_even_lines_and_odd_ones_on_odd_lines():
    for respond, loud, quiet in ((lambda u: u + 0.05 * u**2, "even", "odd"), (cubic, "odd", "even")):
        found = spectra(*recorded(respond, ODD, 1, realisations=2, sigma=1e-6))
        levels = distortions(found, response_matrix(found))
        assert np.mean(getattr(levels, loud).size) > 100.0 * np.mean(getattr(levels, quiet).size)


def test_pairs_of_both_signs_take_away_what_does_not_change_its_sign():
    signals, excitation = recorded(lambda u: u + 0.05 * u**2, ODD, 1, realisations=2, sigma=1e-6, pairs=True)
    found = spectra(signals, excitation)
    assert found.common is not None
    matrix = response_matrix(found)
    np.testing.assert_allclose(matrix.G, 1.0, atol=1e-5)


def test_resonances_are_those_of_the_system_within_their_sigmas(linear):
    found = MeasuredResponse.of(*linear).resonances
    poles = [r for r in found if not r.anti and (r.output, r.input) == (0, 0)]
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-900, 400, -1.5, 0.5], [300, -2500, 0.4, -2.0]])
    roots = np.linalg.eigvals(A)
    first = min((s for s in roots if s.imag > 0), key=abs)
    assert abs(poles[0].frequency - abs(first) / (2 * np.pi)) < 4.0 * poles[0].frequency_sigma
    assert abs(poles[0].damping + first.real / abs(first)) < 4.0 * poles[0].damping_sigma
    assert poles[0].frequency_sigma < 0.01 * poles[0].frequency


def test_a_flat_response_has_no_resonance():
    rng = np.random.default_rng(3)
    G = 1.0 + 0.1 * (rng.standard_normal((80, 1, 1)) + 1j * rng.standard_normal((80, 1, 1)))
    assert resonances(np.arange(1.0, 81.0), G, np.full((80, 1, 1), 0.15), 1e-3) == []


def test_period_lines_pairs_and_realisations_are_found_from_the_signal_alone():
    signals, excitation = recorded(two_by_two, ODD, 2, realisations=2, pairs=True)
    found = find_excitation(signals.inputs, 2, "made")
    assert found.f0 == pytest.approx(excitation.f0)
    np.testing.assert_array_equal(found.lines, ODD)
    assert [(e.realisation, e.number, e.sign, e.periods) for e in found.experiments] == [
        (e.realisation, e.number, e.sign, e.periods) for e in excitation.experiments
    ]
    np.testing.assert_allclose(
        [e.start for e in found.experiments], [e.start for e in excitation.experiments], atol=1e-9
    )


def test_experiments_without_a_gap_between_them_are_told_apart():
    signals, excitation = recorded(two_by_two, LINES, 2, realisations=2, gap=0.0)
    found = find_excitation(signals.inputs, 2, "made")
    assert [(e.realisation, e.number) for e in found.experiments] == [(0, 0), (0, 1), (1, 0), (1, 1)]
    np.testing.assert_allclose(
        [e.start for e in found.experiments], [e.start for e in excitation.experiments], atol=1e-9
    )
    np.testing.assert_allclose(
        response_matrix(spectra(signals, found)).G, response_matrix(spectra(signals, excitation)).G, rtol=1e-9
    )


def test_no_sample_of_the_next_experiment_counts_where_a_period_is_no_multiple_of_the_windows():
    signals = ringing(np.arange(1, 200, 2), realisations=3, periods=4, every=2)
    found = find_excitation(signals.inputs, 1, "made")
    assert [e.start for e in found.experiments] == pytest.approx([0.0, 8.0, 16.0])
    assert [e.periods for e in found.experiments] == [4, 4, 4]


def test_clocks_of_their_own_do_not_turn_the_phase():
    signals, excitation = recorded(two_by_two, LINES, 2, realisations=1)
    t, y = signals.outputs.times, signals.outputs.values
    # the same periodic output as another clock samples it, 2 ms later: a shift of its phase alone
    late = np.vstack([_shifted(part, 0.002) for part in np.split(y, len(y) // N)])
    other = replace(signals, outputs=Signal(t + 0.002, late, signals.outputs.names))
    np.testing.assert_allclose(
        response_matrix(spectra(other, excitation)).G,
        response_matrix(spectra(signals, excitation)).G,
        rtol=1e-6,
        atol=1e-9,
    )


def _shifted(y, seconds):
    Y = np.fft.rfft(y, axis=0) * np.exp(2j * np.pi * RATE / N * np.arange(N // 2 + 1) * seconds)[:, None]
    return np.fft.irfft(Y, axis=0)


def edited(signals, **change):
    return replace(signals, inputs=replace(signals.inputs, **change))


def test_a_recording_of_half_a_period_is_refused(linear):
    signals, _ = linear
    short = Signal(signals.inputs.times[: N // 2], signals.inputs.values[: N // 2], signals.inputs.names)
    with pytest.raises(RecordingError, match="does not repeat itself for two whole periods; record two or more"):
        find_excitation(short, 2, "made")


def test_periods_of_no_whole_number_of_samples_are_refused(linear):
    signals, excitation = linear
    with pytest.raises(RecordingError, match=r"has 398\.51 samples of 5 ms; expected a whole number"):
        spectra(signals, replace(excitation, f0=excitation.f0 * N / 398.51))


def test_clipped_inputs_are_refused(linear):
    signals, excitation = linear
    with pytest.raises(RecordingError, match=r"c0 stands at .* of the samples: it is clipped, .* excite less"):
        spectra(edited(signals, values=np.clip(signals.inputs.values, -8.0, 8.0)), excitation)


def test_lines_above_half_the_rate_are_refused(linear):
    signals, excitation = linear
    with pytest.raises(RecordingError, match=r"lines go up to 150 Hz: above half the rate"):
        spectra(signals, replace(excitation, lines=np.array([300])))


def test_a_line_at_which_nothing_was_excited_is_named():
    signals, excitation = recorded(two_by_two, ODD, 2, realisations=1)
    with pytest.raises(RecordingError, match=r"nothing was excited at line 7 \(3\.5 Hz\); take it out"):
        spectra(signals, replace(excitation, lines=np.sort(np.append(ODD, 7))))


def test_an_excitation_of_another_recording_is_refused():
    signals, excitation = recorded(two_by_two, ODD, 2, realisations=1)
    with pytest.raises(
        RecordingError, match=r"lines of the recording are not excited; it belongs to another recording"
    ):
        spectra(signals, replace(excitation, lines=ODD + 1))
    late = Excitation(excitation.f0, ODD, (Experiment(0, 0, 1, 1e3, 3), Experiment(0, 1, 1, 2e3, 3)))
    with pytest.raises(RecordingError, match=r"said to begin at 1000 s, but the samples end at"):
        spectra(signals, late)


def test_fewer_experiments_than_inputs_are_refused(linear):
    signals, excitation = linear
    with pytest.raises(RecordingError, match="1 experiments for 2 inputs; expected as many as inputs"):
        response_matrix(spectra(signals, replace(excitation, experiments=excitation.experiments[:1])))


def test_inputs_that_move_together_are_refused(linear):
    signals, excitation = linear
    values = signals.inputs.values[:, [0, 0]]
    with pytest.raises(RecordingError, match="the inputs move together in all experiments"):
        response_matrix(spectra(edited(signals, values=values), excitation))


def test_a_lost_sample_is_said_with_its_place(linear):
    signals, excitation = linear
    gone = Signal(np.delete(signals.inputs.times, 700), np.delete(signals.inputs.values, 700, axis=0), ("c0", "c1"))
    with pytest.raises(RecordingError, match=r"samples near .* beside an even grid of 5 ms"):
        spectra(replace(signals, inputs=gone), excitation)


@pytest.mark.parametrize("ppm", [0.0, 40.0])
def test_stamps_that_jitter_and_clocks_that_run_too_fast_are_no_lost_samples(linear, ppm):
    signals, excitation = linear
    rng = np.random.default_rng(4)

    def stamped(signal):
        late = 0.005 * rng.standard_normal(len(signal.times)) / RATE
        late[::501] += 0.8 / RATE  # single ones come nearly a step late
        return replace(signal, times=signal.times * (1.0 + 1e-6 * ppm) + late)

    jittered = replace(signals, inputs=stamped(signals.inputs), outputs=stamped(signals.outputs))
    matrix = response_matrix(spectra(jittered, excitation))
    assert jittered.inputs.step * RATE - 1.0 == pytest.approx(1e-6 * ppm, abs=1e-6)
    ratio = np.abs(matrix.G - true_response(matrix.frequencies)) / matrix.sigmas(matrix.total)
    assert 0.8 < np.sqrt(np.mean(ratio**2)) < 1.25


def test_the_same_phases_again_are_no_other_realisation():
    """Their scatter is noise; what a nonlinear system makes of these phases comes again."""
    gain = 1.0 + 0.75 * 0.02 * (2 * len(ODD) - 1)
    signals, excitation = recorded(cubic, ODD, 1, realisations=1, sigma=1e-3)
    (once,) = excitation.experiments
    t = signals.inputs.times
    later = np.concatenate([t, t + 100.0])
    twice = replace(
        signals,
        inputs=replace(signals.inputs, times=later, values=np.tile(signals.inputs.values, (2, 1))),
        outputs=replace(signals.outputs, times=later, values=np.tile(signals.outputs.values, (2, 1))),
    )
    again = replace(once, realisation=1, start=once.start + 100.0)
    for second in (again, replace(again, start=again.start + 37 / RATE, periods=once.periods - 1)):
        matrix = response_matrix(spectra(twice, replace(excitation, experiments=(once, second))))
        assert matrix.total_from.endswith("(1 said to be others have the same phases, which show noise alone)")
        ratio = np.abs(matrix.G - gain) / matrix.sigmas(matrix.total)
        assert 0.5 < np.sqrt(np.mean(ratio**2)) < 1.7


def test_experiments_that_are_no_pair_are_refused():
    signals, excitation = recorded(two_by_two, ODD, 2, realisations=2, pairs=True)
    a, b, c, d, *rest = excitation.experiments
    swapped = replace(a, start=c.start), b, replace(c, start=a.start), d, *rest
    with pytest.raises(RecordingError, match="two signs of realisation 0, experiment 0 are no pair: their inputs"):
        spectra(signals, replace(excitation, experiments=swapped))


def test_signals_of_few_levels_and_commands_that_stay_are_not_clipped():
    signals, excitation = recorded(lambda u: u, LINES, 1, realisations=2, sigma=1e-3)
    stays = np.repeat(signals.inputs.values[::8], 8, axis=0)
    low = replace(excitation, lines=LINES[LINES < 20])
    for values, lines in ((stays, low), (np.sign(signals.inputs.values), excitation)):
        spectra(edited(signals, values=values), lines)
    with pytest.raises(RecordingError, match="it is clipped"):
        spectra(edited(signals, values=np.clip(stays, -8.0, 8.0)), low)


def shaken_mass(seed, noise_in=0.02, noise_out=1e-4, periods=2, realisations=2):
    """Signals of a mass on a soft servo, f = r - C y, closed in the frequency domain; force and position are noisy."""
    rng, lines = np.random.default_rng(seed), np.arange(1, 100)
    s = 2j * np.pi * 0.5 * lines
    plant, servo = 100.0 / (s**2 + 0.5 * s), ((6.0 * np.pi) ** 2 + 1.4 * 6.0 * np.pi * s) / 100.0
    experiments, u, y, times = [], [], [], []
    for r in range(realisations):
        force, place = np.zeros((2, N // 2 + 1), dtype=complex)
        force[lines] = N / 2 * np.exp(2j * np.pi * rng.random(len(lines))) / (1.0 + plant * servo)
        place[lines] = plant * force[lines]
        for signals, X, sigma in ((u, force, noise_in), (y, place, noise_out)):
            x = np.tile(np.fft.irfft(X), periods)
            signals.append(x + sigma * rng.standard_normal(len(x)))
        start = r * (periods + 0.5) * N / RATE
        times.append(start + np.arange(periods * N) / RATE)
        experiments.append(Experiment(r, 0, 1, start, periods))
    t = np.concatenate(times)
    made = (Signal(t, np.concatenate(x)[:, None], (name,)) for name, x in (("force", u), ("place", y)))
    return Signals("made", "", *made), Excitation(0.5, lines, tuple(experiments)), plant


def test_sigmas_hold_where_the_response_changes_fast_and_inputs_are_noisy():
    """Noise of the force is the larger error, the slower a mass is shaken: not as large as at neighbouring lines."""
    squares = []
    for seed in range(20):
        signals, excitation, plant = shaken_mass(seed)
        matrix = response_matrix(spectra(signals, excitation))
        for covariance in (matrix.noise, matrix.total):
            squares.append(np.abs(matrix.G[:, 0, 0] - plant) ** 2 / covariance[:, 0, 0].real)
    by_line = np.sqrt(np.mean(squares, axis=0))
    assert by_line[0] < 1.6  # 2.9 by the mean of neighbours
    assert np.all((by_line[2:6] > 0.6) & (by_line[2:6] < 1.5))  # 0.1 to 0.4
    assert 0.9 < np.sqrt(np.mean(squares)) < 1.2


def test_sigmas_hold_at_a_resonance_that_follows_a_distortion():
    gain = 1.0 + 0.75 * 0.02 * (2 * len(ODD) - 1)
    squares = []
    for seed in range(12):
        signals, excitation = recorded(cubic, ODD, 1, realisations=3, sigma=1e-3, seed=seed)
        f = 0.5 * np.arange(N // 2 + 1)
        resonant = 1.0 / (1.0 - (f / 14.0) ** 2 + 0.03j * f / 14.0)
        periods = np.fft.rfft(signals.outputs.values.reshape(-1, N), axis=1) * resonant
        signals = replace(signals, outputs=replace(signals.outputs, values=np.fft.irfft(periods).reshape(-1, 1)))
        matrix = response_matrix(spectra(signals, excitation))
        off = matrix.G[:, 0, 0] - gain * resonant[ODD]
        squares.append(np.abs(off) ** 2 / matrix.total[:, 0, 0].real)
    peak = int(np.argmax(np.abs(resonant[ODD])))
    assert np.sqrt(np.mean(squares, axis=0))[peak] < 1.6
    assert 0.85 < np.sqrt(np.mean(squares)) < 1.2
