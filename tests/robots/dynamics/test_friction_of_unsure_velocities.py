# SPDX-License-Identifier: BSD-3-Clause
"""Dry friction of a velocity that is not known well, against its mean over many velocities."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.robots.dynamics.state_rates import StateRates
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

DRAWS = np.linspace(-6.0, 6.0, 201)
WEIGHTS = np.exp(-0.5 * DRAWS**2) / np.exp(-0.5 * DRAWS**2).sum()


@pytest.mark.parametrize("effects", [[], ["link_viscous@joint2", "load_dependent_friction@joint1"]])
@pytest.mark.parametrize("sigma", [1e-4, 5e-3, 0.1])
@pytest.mark.parametrize("mean", [0.0, 4e-3, 0.05])
def test_it_is_the_mean_of_friction_and_its_slope(effects, sigma, mean):
    robot = load_robot("doggy")
    for effect in effects:
        robot = add_effect(robot, effect)
    robot = robot.with_values({name: 0.2 for name in robot.parameters if name.endswith("friction.coefficient")})
    layout = robot.layout
    x = np.zeros(layout.size)
    x[layout.q_link] = 0.05  # the springs carry something
    sharp, smooth = StateRates(robot), StateRates(robot)
    motor = layout.motor_v[0]
    friction, slope = 0.0, 0.0
    for z, weight in zip(DRAWS, WEIGHTS, strict=True):
        x[motor] = mean + sigma * z
        friction += weight * sharp.rates(x, np.zeros(robot.n))[motor]
        slope += weight * z * sharp.rates(x, np.zeros(robot.n))[motor] / sigma
    x[motor] = mean
    smooth.know_velocities(np.full(robot.n, sigma))
    found, by_state, _ = smooth.with_jacobian(x, np.zeros(robot.n))
    x[motor] = 10.0
    most = abs(sharp.rates(x, np.zeros(robot.n))[motor])
    assert found[motor] == pytest.approx(friction, abs=0.03 * most)
    if mean == 0.0:
        assert by_state[motor, motor] == pytest.approx(slope, rel=0.05)


def test_a_velocity_that_is_known_sees_the_law_of_the_file():
    robot = load_robot("doggy")
    rates, x = StateRates(robot), np.full(robot.layout.size, 0.01)
    before = rates.rates(x, np.zeros(robot.n))
    rates.know_velocities(np.full(robot.n, 0.3))
    assert not np.allclose(rates.rates(x, np.zeros(robot.n)), before)
    rates.know_velocities(np.zeros(robot.n))
    np.testing.assert_array_equal(rates.rates(x, np.zeros(robot.n)), before)
