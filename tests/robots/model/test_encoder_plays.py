# SPDX-License-Identifier: BSD-3-Clause
"""Lags of encoders with play, against numbers by hand, differences, and a slow recursion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.simpson_dynamics import SimpsonDynamics
from jointscope.factors.step import Steps
from jointscope.graphs.problem.sensor_placement import factor_on_state
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect, cannot_be_added
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.encoder_plays import EncoderPlays, clipped, unlagged

H = 1e-3
DOGGY = add_effect(load_robot("doggy"), "encoder_hysteresis@joint2", {"half_play": H})
ARM = add_effect(load_robot("biorob"), "encoder_hysteresis@joint3.link", {"half_play": H})


def plays_of(robot) -> EncoderPlays:
    plays = EncoderPlays.of(robot)
    assert plays is not None
    return plays


def path(robot, q) -> np.ndarray:
    """States in which only the coordinate moves whose encoder has play."""
    x = np.zeros((len(q), robot.layout.size))
    x[:, plays_of(robot).positions[0]] = q
    return x


def test_the_reading_stands_still_over_the_play_and_lags_by_half_of_it_beyond():
    q = np.array([0.0, 2.0, 5.0, 4.0, 3.1, 3.0, 1.0, 1.5, 2.9, 4.0]) * 1e-3
    x = plays_of(DOGGY).along(path(DOGGY, q), DOGGY.values)
    reading = q - x[:, plays_of(DOGGY).lags[0]]
    by_hand = np.array([0.0, 1.0, 4.0, 4.0, 4.0, 4.0, 2.0, 2.0, 2.0, 3.0]) * 1e-3
    np.testing.assert_allclose(reading, by_hand, atol=1.5e-5)


@pytest.mark.parametrize("robot", [DOGGY, ARM], ids=["doggy", "biorob"])
def test_lags_along_a_motion_are_those_of_one_step_after_the_other(robot):
    plays, rng = plays_of(robot), np.random.default_rng(1)
    x = path(robot, np.cumsum(rng.normal(size=300) * 0.4 * H))
    quick, slow = plays.along(x, robot.values), x.copy()
    for k in range(1, len(x)):
        slow[k, plays.lags] = plays.after(slow[k - 1], slow[k], plays.sizes(robot.values))
    np.testing.assert_allclose(quick, slow, atol=1e-15)
    assert np.ptp(quick[:, plays.lags]) == pytest.approx(2.0 * H, rel=1e-3)


def test_slopes_are_those_of_differences_on_contact_within_the_play_and_in_the_corner():
    moved, corner, step = np.linspace(-2.0, 2.0, 401) * H, 0.1 * H, 1e-9
    plays = replace(plays_of(DOGGY), corners=np.array([corner]))
    x0, x1 = np.zeros((len(moved), DOGGY.layout.size)), path(DOGGY, moved)
    _, inside, by_size = plays.with_slopes(x0, x1, np.array([H]))
    for found, near in (
        (inside, clipped(moved + step, H, corner) - clipped(moved - step, H, corner)),
        (by_size, clipped(moved, H + step, corner) - clipped(moved, H - step, corner)),
    ):
        np.testing.assert_allclose(found[:, 0], near / (2.0 * step), atol=1e-4)
    assert inside[200, 0] == 1.0 and inside[0, 0] == inside[-1, 0] == 0.0
    assert by_size[0, 0] == -1.0 and by_size[-1, 0] == 1.0


def test_without_width_there_is_exactly_no_lag():
    moved = np.random.default_rng(2).normal(size=100) * 1e-3
    assert np.all(clipped(moved, 0.0, 1e-5) == 0.0)


def test_at_rest_nothing_creeps():
    plays = plays_of(DOGGY)
    x = plays.along(path(DOGGY, np.r_[np.linspace(0.0, 3e-3, 40), np.full(5000, 3e-3)]), DOGGY.values)
    lag = x[:, plays.lags[0]]
    assert lag[39] == pytest.approx(H, rel=1e-3)
    assert lag[39] - lag[-1] < 1.01 * plays.corners[0]


def test_states_found_without_play_are_moved_ahead_of_their_readings():
    plays = plays_of(DOGGY)
    read = np.r_[np.linspace(0.0, 0.1, 200), np.full(20, 0.1), np.linspace(0.1, 0.0, 200)]
    x = unlagged(DOGGY, path(DOGGY, read))
    ahead = x[:, plays.positions[0]] - read
    assert ahead[150] == pytest.approx(H, rel=1e-3) and ahead[-1] == pytest.approx(-H, rel=1e-3)
    np.testing.assert_allclose(x[[150, -1], plays.lags[0]], [H, -H], rtol=1e-3)
    assert np.array_equal(unlagged(DOGGY, path(DOGGY, read), known=DOGGY.layout.memories), path(DOGGY, read))


@pytest.mark.parametrize("robot", [DOGGY, ARM], ids=["doggy", "biorob"])
def test_rows_of_the_lag_have_the_derivatives_of_differences(robot):
    m, rng, plays = 6, np.random.default_rng(3), plays_of(robot)
    size = robot.layout.size
    x0, x1 = rng.normal(size=(2, m, size)) * 0.1
    x0[:, plays.lags[0]] = np.array([0.0, 0.5, -0.5, 0.9, -0.9, 0.2]) * H
    x1[:, plays.positions[0]] = x0[:, plays.positions[0]] + np.array([0.2, 5.0, -5.0, -0.4, 0.7, -0.6]) * H
    steps = Steps(np.full(m, 1e-3), np.zeros((m, robot.n)), robot.noise, robot.layout)
    factor, calibration = SimpsonDynamics(ElasticJoints(robot), steps, robot.joints), Calibration.of(robot)
    row, found, step = plays.rows[0], factor.linearize((x0, x1), calibration), 1e-8
    for side in (0, 1):
        for column in range(size):
            move = np.eye(size)[column] * step
            ends = [[x + sign * move * (i == side) for i, x in enumerate((x0, x1))] for sign in (1.0, -1.0)]
            near = [factor.residual((a, b), calibration)[:, row] for a, b in ends]
            by = found.by_state[side][:, row, column]
            np.testing.assert_allclose(by, (near[0] - near[1]) / (2.0 * step), atol=1e-6)
    name = plays.widths[0]
    wide = [
        factor.residual((x0, x1), Calibration.of(robot.with_values({name: H + sign * step})))[:, row]
        for sign in (1.0, -1.0)
    ]
    by = found.by_block[DYNAMICS][:, row, calibration.names.index(name)]
    np.testing.assert_allclose(by, (wide[0] - wide[1]) / (2.0 * step), atol=1e-6)


@pytest.mark.parametrize(("robot", "sensor", "channel"), [(DOGGY, "motor_encoder", 1), (ARM, "link_encoder", 2)])
def test_a_reading_is_the_angle_less_its_lag_and_other_sensors_do_not_feel_it(robot, sensor, channel):
    x = np.random.default_rng(4).normal(size=(3, robot.layout.size))
    calibration, times = Calibration.of(robot), np.zeros(3)
    lagged = x.copy()
    lagged[:, plays_of(robot).lags] += 2e-3
    for name, own in robot.sensors.items():
        factor = factor_on_state(robot, name, np.zeros((3, len(own.channels))), times)
        change = factor.residual((lagged,), calibration) - factor.residual((x,), calibration)
        expected = np.zeros_like(change)
        if name == sensor:
            expected[:, channel] = -2e-3
        np.testing.assert_allclose(change, expected, atol=1e-12)


def test_links_that_are_free_have_no_steps_that_a_lag_could_follow():
    free = replace(load_robot("doggy"), choices=replace(load_robot("doggy").choices, link_dynamics="free"))
    why = cannot_be_added(free, EffectAt(catalogue()["encoder_hysteresis"], "joint1"))
    assert why == "needs equations of motion, and the links of this robot are free"
