# SPDX-License-Identifier: BSD-3-Clause
"""Rows of a step under torques that are new at every moment: independent, and as large as their sigmas say.

The noise is summed here in thousands of little steps; no formula of the factors is used.
"""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.factors.euler_dynamics import EulerDynamics
from jointscope.factors.midpoint_dynamics import MidpointDynamics
from jointscope.factors.simpson_dynamics import SimpsonDynamics
from jointscope.factors.step import Steps
from jointscope.graphs.fixed_lag.window.tick_step import undivided_step
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.dynamics.state_rates import StateRates
from jointscope.robots.files.robot_file import load_robot

FACTORS = {"euler": EulerDynamics, "midpoint": MidpointDynamics, "simpson": SimpsonDynamics}
H, COUNT, PIECES = 1e-5, 4000, 200  # a step so short that nothing else happens


def moved_by_noise(rng, density):
    """What white torques add to velocity and position over steps of length H, shapes (COUNT,)."""
    pieces = density * np.sqrt(H / PIECES) * rng.standard_normal((COUNT, PIECES))
    velocity = np.cumsum(pieces, axis=1)
    before = np.hstack([np.zeros((COUNT, 1)), velocity[:, :-1]])
    return velocity[:, -1], (0.5 * (before + velocity)).sum(axis=1) * H / PIECES


@pytest.mark.parametrize("rule", FACTORS)
def test_rows_of_white_torques_are_independent_and_of_unit_variance(rule):
    robot = load_robot("doggy")
    layout, rng = robot.layout, np.random.default_rng(3)
    start, u = np.zeros(layout.size), np.zeros(robot.n)
    model = StateRates(robot)
    end = undivided_step(model, rule, start, model.command_torque(u), H).x1
    density = robot.noise.motor_velocity
    x0, x1 = np.tile(start, (COUNT, 1)), np.tile(end, (COUNT, 1))
    for j, (q, v) in enumerate(zip(layout.motor_q, layout.motor_v, strict=True)):
        velocity, position = moved_by_noise(rng, density[j])
        x1[:, v] += velocity
        x1[:, q] += position
    steps = Steps(np.full(COUNT, H), np.tile(u, (COUNT, 1)), robot.noise, layout)
    factor = FACTORS[rule](ElasticJoints(robot), steps, robot.joints)
    rows = factor.residual((x0, x1), Calibration.of(robot)) / factor.sigmas
    told = [i for i, name in enumerate(factor.rows) if ".motor_" in name]
    found = np.cov(rows[:, told].T)
    assert found == pytest.approx(np.eye(len(told)), abs=4.0 * np.sqrt(2.0 / COUNT))
