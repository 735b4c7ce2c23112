# SPDX-License-Identifier: BSD-3-Clause
"""Steps of robots several of whose encoders have play: behind coupled ropes, on rigid joints, two on one joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.factors.step import Steps
from jointscope.graphs.fixed_lag.window.tick_step import take_step
from jointscope.graphs.problem.bag_problem import INTEGRATORS
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.dynamics.state_rates import StateRates
from jointscope.robots.files.effect_editing import add_effect, carried_noise
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot

HALF, H = 1e-3, 1e-3  # [rad], [s]


def loose(robot: Robot, *owners: str) -> Robot:
    for owner in owners:
        robot = add_effect(robot, f"encoder_hysteresis@{owner}", {"half_play": HALF})
    return robot


def rigid(name: str, *joints: str) -> Robot:
    robot = load_robot(name)
    plain = replace(robot, transmission=None, choices=replace(robot.choices, rigid_joints=joints))
    return replace(plain, noise=carried_noise(robot, plain))


ROBOTS = {
    "coupled ropes": loose(load_robot("biorob"), "joint3.link", "joint3", "joint4", "joint1.link"),
    "rigid joints": loose(rigid("doggy", "joint1", "joint2"), "joint1", "joint2", "joint3"),
    "two on a rigid joint": loose(rigid("biorob", "joint3"), "joint3.link", "joint3"),
}


@pytest.mark.parametrize("rule", list(INTEGRATORS))
@pytest.mark.parametrize("name", list(ROBOTS))
def test_lags_follow_states_and_torques_as_differences_say_and_leave_the_factor_no_defect(name, rule):
    robot = replace(ROBOTS[name], choices=replace(ROBOTS[name].choices, integrator=rule))
    model, rng, size = StateRates(robot), np.random.default_rng(1), robot.layout.size
    plays, torque = model.plays, np.full(robot.n, 0.5)
    assert plays is not None and len(plays.lags) > 1
    x0 = 0.05 * rng.normal(size=size)
    # the first one is on contact at the end, the others are within their plays
    x0[robot.layout.velocities] = 0.2 * rng.normal(size=len(robot.layout.velocities))
    x0[plays.lags] = np.r_[2.0 * HALF, np.full(len(plays.lags) - 1, 0.1 * HALF)]
    step, e = take_step(model, rule, x0, torque, H), 1e-7
    assert abs(step.x1[plays.lags[0]]) == pytest.approx(HALF) and np.all(np.abs(step.x1[plays.lags[1:]]) < 0.9 * HALF)

    def lags(x, tau):
        return take_step(model, rule, x, tau, H).x1[plays.lags]

    moved = [(lags(x0 + e * u, torque) - lags(x0 - e * u, torque)) / (2.0 * e) for u in np.eye(size)]
    np.testing.assert_allclose(step.transition[plays.lags], np.array(moved).T, atol=1e-5)
    pushed = [(lags(x0, torque + u) - lags(x0, torque - u)) / 2.0 for u in 1e-3 * np.eye(robot.n)]
    response = 1e-3 * (step.by_end_inverse @ step.by_torque)[plays.lags]
    # the response to a torque is that of where a step begins; friction and dampers turn it by some thousandths
    np.testing.assert_allclose(response, np.array(pushed).T, atol=5e-3 * np.abs(response).max() + 1e-15)
    np.testing.assert_allclose(step.by_end @ step.by_end_inverse, np.eye(size), atol=1e-9)
    steps = Steps(np.full(1, H), np.zeros((1, robot.n)), robot.noise, robot.layout)
    factor = INTEGRATORS[rule](ElasticJoints(robot), steps, robot.joints)
    found = factor.linearize((x0[None], step.x1[None]), Calibration.of(robot))
    np.testing.assert_allclose(found.residual[:, plays.rows], 0.0, atol=1e-15)
    np.testing.assert_allclose(found.by_state[0][0, plays.rows], step.by_start[plays.lags], atol=1e-12)
    np.testing.assert_allclose(found.by_state[1][0, plays.rows], step.by_end[plays.lags], atol=1e-12)
