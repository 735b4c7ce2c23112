# SPDX-License-Identifier: BSD-3-Clause
"""Encoders weigh by their noise while joints move; what stands still says nothing about those that do not."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.robots.recordings.recording import Stream
from jointscope.tools.init.streams.encoder_noise import encoder_noise
from jointscope.tools.init.streams.sensor_noise import noise_in_motion
from jointscope.tools.init.streams.standing import Stance

RATE = 125.0
AT_REST = {"gripper": Stance(mean=0.3, span=1e-7, least=1e-3, moves=False, noise=3e-8)}
SINES = ((0.3, 0.4), (0.9, 0.2), (1.9, 0.1))  # [Hz], [rad]


def angle(times: np.ndarray, seed: int, begin: float = 0.0, end: float = np.inf) -> np.ndarray:
    """A motion between two times, at rest before and after."""
    phases = np.random.default_rng(seed).uniform(0.0, 6.0, len(SINES))
    s = np.clip(np.minimum((times - begin) / 0.4, (end - times) / 0.4), 0.0, 1.0)
    moved = sum(a * np.sin(2.0 * np.pi * f * times + p) for (f, a), p in zip(SINES, phases, strict=True))
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2) * moved


def sigmas(values: np.ndarray, times: np.ndarray, stances=AT_REST) -> list[float]:
    names = tuple(f"j{k}" for k in range(values.shape[1]))
    stream = Stream("encoder", times, values, names, "")
    return [guess.sigma for guess in encoder_noise(stream, ["rad"] * len(names), (), stances)]


def stamps(seed: int = 4) -> np.ndarray:
    times = np.arange(0.0, 10.0, 1.0 / RATE)
    return times + np.random.default_rng(seed).uniform(0.0, 0.02 / RATE, len(times))


def test_a_gripper_at_rest_does_not_speak_for_encoders_that_have_noise_of_their_own():
    times, rng = stamps(), np.random.default_rng(1)
    values = np.column_stack([angle(times, seed) + 2e-5 * rng.standard_normal(len(times)) for seed in (1, 2)])
    assert sigmas(values, times) == pytest.approx([2e-5] * 2, rel=0.15)


def test_it_does_where_a_motion_is_too_fast_for_the_rate():
    times = np.arange(0.0, 10.0, 1.0 / 30.0)
    fast = 0.2 * np.sin(2.0 * np.pi * 9.3 * times + 0.3) + 0.2 * np.sin(2.0 * np.pi * 7.1 * times)
    assert noise_in_motion(times, fast) == 0.0
    assert sigmas(fast[:, None], times) == [3e-8]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_stamps_that_jitter_count_also_of_a_joint_that_stands_most_of_the_time(seed):
    true, rng = stamps(), np.random.default_rng(seed)
    told = true + 2e-4 * rng.uniform(-1.0, 1.0, len(true))
    values = np.column_stack([angle(true, seed), angle(true, seed + 9, 2.0, 4.0)])
    values += 3e-8 * rng.standard_normal(values.shape)
    for sigma, begin, end, column in zip(sigmas(values, told), (0.0, 2.2), (10.0, 3.8), values.T, strict=True):
        speeds = np.gradient(column, true)[(true > begin) & (true < end)]
        error = 2e-4 / np.sqrt(3.0) * np.sqrt(np.mean(speeds**2))
        assert 0.5 * error < sigma < 2.0 * error


@pytest.mark.parametrize("counts", [4096, 65536])
def test_counters_have_the_noise_of_their_steps_also_where_they_stand(counts):
    times, step = stamps(), 2.0 * np.pi / counts
    values = np.column_stack([angle(times, 1), angle(times, 2, 2.0, 4.0)])
    assert sigmas(step * np.rint(values / step), times, {}) == pytest.approx([step / np.sqrt(12.0)] * 2, rel=0.35)
