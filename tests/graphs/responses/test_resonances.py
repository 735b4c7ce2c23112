# SPDX-License-Identifier: BSD-3-Clause
"""Resonance and anti-resonance of two masses on a spring, against the roots of their equations of motion."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.responses.resonances import resonances

MOTOR, LOAD, SPRING, DAMPER, BEARING = 1.5, 0.8, 6000.0, 4.0, 20.0  # [kg m2, kg m2, N m/rad, N m s/rad, N m s/rad]


def motor_angle_per_torque(f):
    """Shape (l, 1, 1) [rad/(N m)]: both equations of motion, solved at each frequency."""
    s = 2j * np.pi * f
    spring = SPRING + DAMPER * s
    M = np.empty((len(f), 2, 2), complex)
    M[:, 0, 0], M[:, 1, 1] = MOTOR * s**2 + BEARING * s + spring, LOAD * s**2 + spring
    M[:, 0, 1] = M[:, 1, 0] = -spring
    return np.linalg.inv(M)[:, :1, :1]


def true_roots():
    """Frequency [Hz] and damping of the resonance and of the anti-resonance."""
    c, k = np.array([[DAMPER + BEARING, -DAMPER], [-DAMPER, DAMPER]]), SPRING * np.array([[1.0, -1.0], [-1.0, 1.0]])
    inverse = np.diag([1.0 / MOTOR, 1.0 / LOAD])
    poles = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ k, -inverse @ c]]))
    zero = np.roots([LOAD, DAMPER, SPRING])[0]
    return [(abs(root) / (2.0 * np.pi), -root.real / abs(root)) for root in (poles[np.argmax(poles.imag)], zero)]


@pytest.mark.parametrize("apart", [0.25, 1.0])
def test_a_dip_beside_a_peak_is_found_where_the_equations_have_it(apart):
    f = np.arange(0.5, 200.0, apart)
    G = motor_angle_per_torque(f)
    sigma = np.full(G.shape, 1e-8)  # as of an encoder: the same at all lines
    rng = np.random.default_rng(3)
    noisy = G + sigma * (rng.normal(size=G.shape) + 1j * rng.normal(size=G.shape)) / np.sqrt(2.0)
    found = {r.anti: r for r in resonances(f, noisy, sigma, 1e-3)}
    for anti, (frequency, damping) in zip((False, True), true_roots(), strict=True):
        r = found[anti]
        assert abs(r.frequency - frequency) < 3.0 * r.frequency_sigma and abs(r.frequency / frequency - 1.0) < 0.002
        assert abs(r.damping - damping) < 3.0 * r.damping_sigma and r.damping_sigma < 0.003


@pytest.mark.parametrize("apart", [0.25, 1.0])
def test_commands_that_are_held_and_taken_for_measured_do_not_damp_a_dip(apart):
    """A value that is held acts half a sample later: the phase of that is not the damping of a zero."""
    f = np.arange(apart, 60.0, apart)
    held = np.sinc(f * 1e-3) * np.exp(-1j * np.pi * f * 1e-3)
    G = motor_angle_per_torque(f) * held[:, None, None]
    sigma = np.full(G.shape, 3e-9)
    rng = np.random.default_rng(4)
    noisy = G + sigma * (rng.normal(size=G.shape) + 1j * rng.normal(size=G.shape)) / np.sqrt(2.0)
    found = {r.anti: r for r in resonances(f, noisy, sigma, 1e-3)}
    for anti, (frequency, damping) in zip((False, True), true_roots(), strict=True):
        r = found[anti]
        assert abs(r.frequency - frequency) < 3.0 * r.frequency_sigma and r.frequency_sigma < 0.001 * frequency
        assert abs(r.damping - damping) < 3.0 * r.damping_sigma and r.damping_sigma < 0.02 * damping


@pytest.mark.parametrize("step", [1e-3, 4e-3])
def test_held_commands_are_smaller_at_higher_lines_which_small_sigmas_tell_from_damping(step):
    f = np.arange(0.25, 60.0, 0.5)
    G = motor_angle_per_torque(f) * (np.sinc(f * step) * np.exp(-1j * np.pi * f * step))[:, None, None]
    sigma = np.full(G.shape, 1e-11)
    off = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        noisy = G + sigma * (rng.normal(size=G.shape) + 1j * rng.normal(size=G.shape)) / np.sqrt(2.0)
        peak = next(r for r in resonances(f, noisy, sigma, step) if not r.anti)
        frequency, damping = true_roots()[0]
        assert peak.damping_sigma < 1e-4 * damping
        off.append([(peak.frequency - frequency) / peak.frequency_sigma, (peak.damping - damping) / peak.damping_sigma])
    assert np.all(np.abs(np.mean(off, axis=0)) < 1.3)  # 3 without


def test_lines_below_the_noise_are_no_resonances():
    f = np.arange(0.1, 60.0, 0.1)
    G = motor_angle_per_torque(f)
    sigma = np.full(G.shape, 1e-5)  # what comes out above 20 Hz is less
    for seed in range(3):
        rng = np.random.default_rng(seed)
        noisy = G + sigma * (rng.normal(size=G.shape) + 1j * rng.normal(size=G.shape)) / np.sqrt(2.0)
        found = resonances(f, noisy, sigma, 1e-3)
        assert all(13.0 < r.frequency < 18.0 for r in found) and len(found) <= 2
