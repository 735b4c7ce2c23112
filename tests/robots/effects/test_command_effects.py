# SPDX-License-Identifier: BSD-3-Clause
"""Effects on the command: the mean over each step and its derivatives, for equal and unequal steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_check import null_values
from jointscope.robots.files.robot_file import load_robot

DOGGY = load_robot("doggy")
COMMANDS = [effect for effect in catalogue().values() if isinstance(effect, CommandEffect)]


def of(effects):
    return pytest.mark.parametrize("effect", effects, ids=lambda effect: effect.id)


def null(effect) -> dict[str, float]:
    return null_values(effect.parameters)


def held_commands(equal: bool) -> tuple[np.ndarray, np.ndarray]:
    """Edges of the steps and commands that jump, with zeros among them."""
    rng = np.random.default_rng(2)
    steps = np.full(60, 1e-3) if equal else rng.uniform(0.3e-3, 4e-3, 60)
    return 0.2 + np.append(0.0, np.cumsum(steps)), np.where(rng.random(60) < 0.2, 0.0, rng.uniform(-0.9, 0.9, 60))


@of(COMMANDS)
@pytest.mark.parametrize("equal", [True, False])
def test_at_null_the_command_comes_back(effect, equal):
    edges, commands = held_commands(equal)
    acting, by = effect.law(edges, commands, null(effect))
    assert np.array_equal(acting, commands) and acting is not commands
    assert set(by) == {p.name for p in effect.parameters}
    h = 1e-9
    for size in (p.name for p in effect.parameters if not p.is_shape):
        near = (effect.law(edges, commands, null(effect) | {size: h})[0] - commands) / h
        np.testing.assert_allclose(by[size], near, rtol=1e-5, atol=1e-4)


@of(COMMANDS)
@pytest.mark.parametrize("equal", [True, False])
def test_derivatives_of_commands_agree_with_differences(effect, equal):
    edges, commands = held_commands(equal)
    for factor in (0.02, 0.31, 1.0, 7.3):
        values = {name: factor * 1.0137 * size for name, size in effect.example.items()}
        _, by = effect.law(edges, commands, values)
        for name, value in values.items():
            h = 1e-6 * value
            up, down = (effect.law(edges, commands, values | {name: value + side})[0] for side in (h, -h))
            np.testing.assert_allclose(by[name], (up - down) / (2 * h), rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize("effect_id", ["command_delay", "motor_lag"])
def test_at_null_a_late_command_changes_with_the_jump_over_the_step(effect_id):
    edges, commands = held_commands(equal=False)
    effect = catalogue()[effect_id]
    _, by = effect.law(edges, commands, null(effect))
    jump = np.diff(commands, prepend=commands[0])
    np.testing.assert_allclose(next(iter(by.values())), -jump / np.diff(edges), rtol=1e-12)


@pytest.mark.parametrize(
    ("effect_id", "value"), [("command_delay", 0.4e-3), ("command_delay", 9.7e-3), ("motor_lag", 3e-3)]
)
def test_the_mean_command_of_each_step_agrees_with_a_fine_grid(effect_id, value):
    edges, commands = held_commands(equal=False)
    effect = catalogue()[effect_id]
    (name,) = effect.example
    acting, _ = effect.law(edges, commands, {name: value})
    fine = 400
    t = (edges[:-1, None] + np.diff(edges)[:, None] * (np.arange(fine) + 0.5) / fine).ravel()
    if effect_id == "command_delay":
        held = commands[np.clip(np.searchsorted(edges, t - value, side="right") - 1, 0, None)]
    else:
        held, y = np.empty_like(t), commands[0]
        dt = np.repeat(np.diff(edges) / fine, fine)
        for k, u in enumerate(np.repeat(commands, fine)):
            middle = u + (y - u) * np.exp(-0.5 * dt[k] / value)
            held[k], y = middle, u + (y - u) * np.exp(-dt[k] / value)
    np.testing.assert_allclose(
        acting, held.reshape(-1, fine).mean(axis=1), atol=2.5e-3 if "delay" in effect_id else 1e-6
    )


def test_a_long_lag_forgets_nothing():
    edges, commands = held_commands(equal=True)
    acting, by = catalogue()["motor_lag"].law(edges, commands, {"time_constant": 1e3})
    np.testing.assert_allclose(acting, commands[0], atol=1e-4)
    assert np.all(np.isfinite(by["time_constant"]))


def test_the_deadband_swallows_small_commands():
    u = np.array([-0.5, -0.01, 0.0, 0.01, 0.5])
    acting, by = catalogue()["pwm_deadband"].law(np.arange(6.0), u, {"width": 0.02})
    np.testing.assert_allclose(acting, [-0.48, 0, 0, 0, 0.48])
    assert np.array_equal(by["width"], [1, 0, 0, 0, -1])


def test_what_is_cut_off_is_measured_in_the_unit_of_the_command():
    effect = catalogue()["truncated_command"]
    for unit, start in (("duty", 0.005), ("V", 0.16), ("N m", 0.1)):
        robot = replace(DOGGY, command=replace(DOGGY.command, unit=unit))
        (lost,) = effect.parameters_of(robot, "joint1")
        assert lost.start == pytest.approx(start) and lost.prior_sigma == pytest.approx(20.0 * start)


def test_a_driver_that_cuts_to_whole_numbers_loses_half_a_step_on_average():
    asked = np.linspace(-9.98, 9.98, 500)  # no multiple of the step, nothing below one
    asked = asked[np.abs(asked) > 1.0]
    acting, by = catalogue()["truncated_command"].law(np.arange(len(asked) + 1.0), np.trunc(asked), {"lost": 0.5})
    assert abs(np.mean((acting - asked) * np.sign(asked))) < 0.01
    assert np.array_equal(by["lost"], np.sign(asked))


def test_the_deadband_is_measured_in_the_unit_of_the_command():
    effect = catalogue()["pwm_deadband"]
    for unit, start in (("duty", 0.02), ("V", 0.64), ("N m", 0.2)):
        robot = replace(DOGGY, command=replace(DOGGY.command, unit=unit))
        (width,) = effect.parameters_of(robot, "joint1")
        assert (width.unit, width.start) == ("1" if unit == "duty" else unit, pytest.approx(start))


def test_a_drive_that_saturates_gives_no_more_than_its_limit():
    u = np.array([-0.9, -0.4, 0.0, 0.3, 0.5])
    acting, by = catalogue()["command_limit"].law(np.arange(6.0), u, {"lost": 1.0, "limit": 0.4})
    np.testing.assert_allclose(acting, [-0.4, -0.4, 0.0, 0.3, 0.4])
    np.testing.assert_allclose(by["limit"], [-1, 0, 0, 0, 1])
    half, _ = catalogue()["command_limit"].law(np.arange(6.0), u, {"lost": 0.5, "limit": 0.4})
    np.testing.assert_allclose(half, [-0.65, -0.4, 0.0, 0.3, 0.45])


def test_the_limit_is_looked_for_around_a_full_command():
    effect = catalogue()["command_limit"]
    for unit, full in (("duty", 1.0), ("V", 32.0), ("N m", float(DOGGY.tree.effort_limits[0]) or 40.0)):
        robot = replace(DOGGY, command=replace(DOGGY.command, unit=unit))
        lost, limit = effect.parameters_of(robot, "joint1")
        assert (lost.unit, limit.unit) == ("1", "1" if unit == "duty" else unit)
        assert limit.start == pytest.approx(0.9 * full) and limit.grid[2] == pytest.approx(0.4 * full)
