# SPDX-License-Identifier: BSD-3-Clause
"""What commands act in a step, in whatever order they come, against sums over microseconds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.fixed_lag.messages.command_history import CommandHistory
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

DOGGY = load_robot("doggy")
FINE = 1e-5  # [s]


def commands(seed, count=60):
    """Irregular stamps and values."""
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.uniform(5e-4, 2e-3, count)), rng.uniform(-1.0, 1.0, (count, 3))


def held(times, u, t):
    """The command that acts at times of shape (m,), zero before the first, shape (m, 3)."""
    index = np.searchsorted(times, t, side="right") - 1
    return np.where(index[:, None] >= 0, u[index], 0.0)


def brute_mean(signal, t0, t1):
    """Mean of a signal by the middles of many small pieces."""
    count = round((t1 - t0) / FINE * 10)
    middles = t0 + (np.arange(count) + 0.5) * (t1 - t0) / count
    return signal(middles).mean(axis=0)


@pytest.mark.parametrize("seed", range(3))
def test_the_mean_is_that_of_the_held_command(seed):
    times, u = commands(seed)
    order = np.random.default_rng(seed).permutation(len(times))
    history = CommandHistory(DOGGY, 0.1)
    for i in order:
        history.add(times[i], u[i])
    rng = np.random.default_rng(7)
    for _ in range(30):
        t0 = rng.uniform(-2e-3, times[-1] + 2e-3)
        t1 = t0 + rng.uniform(2e-4, 4e-3)
        expected = brute_mean(lambda t: held(times, u, t), t0, t1)
        np.testing.assert_allclose(history.mean(t0, t1), expected, atol=5e-3)


def test_a_step_between_two_commands_gets_exactly_the_first():
    times, u = commands(1)
    history = CommandHistory(DOGGY, 0.1)
    for t, value in zip(times, u, strict=True):
        history.add(t, value)
    np.testing.assert_array_equal(history.mean(times[7], times[8]), u[7])


def test_a_measured_drive_signal_is_linear_between_its_samples_in_any_order():
    robot = replace(DOGGY, command=replace(DOGGY.command, held=False))
    times, u = commands(2)
    history = CommandHistory(robot, 0.1)
    for i in np.random.default_rng(2).permutation(len(times)):
        history.add(times[i], u[i])
    rng = np.random.default_rng(8)
    for _ in range(30):
        t0 = rng.uniform(times[0], times[-1] - 5e-3)
        t1 = t0 + rng.uniform(2e-4, 4e-3)
        expected = brute_mean(lambda t: np.array([np.interp(t, times, column) for column in u.T]).T, t0, t1)
        np.testing.assert_allclose(history.mean(t0, t1), expected, atol=1e-4)
    np.testing.assert_allclose(history.mean(times[7], times[8]), 0.5 * (u[7] + u[8]))
    assert history.unsure_since(times[8]) == times[7]  # the sample at the end of a step tells what acted in it


def effect_signal(name, value, times, u):
    """The command behind an effect, integrated by hand in steps of ten microseconds."""
    if name == "command_delay":
        return lambda t: held(times, u, t - value)
    grid = np.arange(0.0, times[-1] + 5e-3, FINE)
    lagged, share = np.zeros((len(grid), 3)), 1.0 - np.exp(-FINE / value)
    for k in range(1, len(grid)):
        lagged[k] = lagged[k - 1] + share * (held(times, u, grid[k - 1 : k] + 0.5 * FINE)[0] - lagged[k - 1])
    return lambda t: np.array([np.interp(t, grid, column) for column in lagged.T]).T


@pytest.mark.parametrize(
    ("name", "parameter", "value"), [("command_delay", "delay", 1.7e-3), ("motor_lag", "time_constant", 2.5e-3)]
)
def test_effects_see_the_whole_history_in_the_order_of_stamps(name, parameter, value):
    robot = add_effect(DOGGY, f"{name}@robot", {parameter: value})
    times, u = commands(3)
    history = CommandHistory(robot, 0.1)
    for i in np.random.default_rng(3).permutation(len(times)):
        history.add(times[i], u[i])
    signal = effect_signal(name, value, times, u)
    for k in range(20, 55, 5):
        t0, t1 = times[k], times[k + 1]
        expected = brute_mean(signal, t0, t1)
        np.testing.assert_allclose(history.mean(t0, t1), expected, atol=0.02)


def test_the_period_is_learned_again_when_it_changes():
    history, t = CommandHistory(DOGGY, 0.1), 0.0
    for period in (1e-3, 1e-2, 2e-3):
        for _ in range(60):
            t += period
            history.add(t, np.zeros(3))
        assert history.period == pytest.approx(period, rel=1e-6)


def test_two_stamps_that_are_nearly_one_do_not_fix_the_period():
    history = CommandHistory(DOGGY, 0.1)
    history.add(0.0, np.zeros(3))
    history.add(1e-9, np.zeros(3))
    for k in range(1, 30):
        history.add(1e-3 * k, np.zeros(3))
    assert history.period == pytest.approx(1e-3)


def test_lost_and_late_commands_do_not_make_the_period_longer():
    history, rng = CommandHistory(DOGGY, 0.1), np.random.default_rng(2)
    stamps = np.arange(500) * 1e-3
    stamps = stamps[rng.uniform(size=500) > 0.3]
    for i in np.argsort(stamps + rng.uniform(0.0, 5e-3, len(stamps))):
        history.add(stamps[i], np.zeros(3))
    assert history.period == pytest.approx(1e-3)


def test_nothing_is_in_doubt_while_commands_come():
    history = CommandHistory(DOGGY, 0.1)
    for k in range(50):
        history.add(1e-3 * k, np.full(3, 0.1 * (k % 5)))
    assert history.doubt(0.020, 0.021) is None and history.doubt(0.020, 0.0235) is None


def test_a_missing_command_lay_between_its_neighbours():
    history = CommandHistory(DOGGY, 0.1)
    for k in range(50):
        if k != 30:
            history.add(1e-3 * k, np.full(3, 0.01 * k))
    shift, sigma = history.doubt(0.030, 0.031)
    np.testing.assert_allclose(shift, 0.01)  # 0.29 is held, 0.30 was meant, 0.31 follows
    np.testing.assert_allclose(sigma, 0.02 / np.sqrt(12.0))
    half, _ = history.doubt(0.029, 0.031)
    np.testing.assert_allclose(half, 0.005)


def test_an_error_that_all_steps_of_a_gap_share_adds_up_to_itself():
    history = CommandHistory(DOGGY, 0.1)
    for k in range(100):
        if not 40 <= k < 60:
            history.add(1e-3 * k, np.full(3, 1.0 if k >= 60 else 0.0))
    steps = [history.doubt(1e-3 * k, 1e-3 * (k + 1)) for k in range(40, 60)]
    impulse = np.sqrt(sum(sigma**2 for _, sigma in steps)) * 1e-3
    # half a change too much or too little for the whole gap, a third of it as standard deviation
    assert 0.5 < impulse[0] / (0.02 / np.sqrt(12.0)) < 1.1
    shifts = np.array([shift[0] for shift, _ in steps])
    assert np.all(np.diff(shifts) > 0.0) and 0.0 < shifts[0] < 0.1 and 0.9 < shifts[-1] < 1.0


def test_history_is_bounded():
    history = CommandHistory(DOGGY, 0.1)
    for k in range(5000):
        history.add(1e-3 * k, np.zeros(3))
    assert len(history) < 700
    for k in range(100):
        history.add(-1.0 - k, np.zeros(3))
    assert len(history) < 700


def test_what_cannot_be_right_is_forgotten():
    history = CommandHistory(DOGGY, 0.1)
    for k in range(20):
        history.add(1e-3 * k, np.full(3, 0.5))
    history.add(1e9, np.ones(3))
    history.forget_after(1.0)
    assert len(history) == 1  # the last one before it
    np.testing.assert_array_equal(history.mean(0.019, 0.020), np.full(3, 0.5))


def test_it_tells_until_when_a_command_acts():
    history = CommandHistory(DOGGY, 0.1)
    for t in (0.0, 1e-3, 2e-3):
        history.add(t, np.zeros(3))
    assert history.acts_until(0.5e-3) == 1e-3 and history.acts_until(2e-3) == np.inf
    delayed = CommandHistory(add_effect(DOGGY, "command_delay@robot"), 0.1)
    for t in (0.0, 1e-3):
        delayed.add(t, np.zeros(3))
    assert delayed.acts_until(0.0) > 0.3
