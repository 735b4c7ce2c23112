# SPDX-License-Identifier: BSD-3-Clause
"""A step from a known state ends where the dynamics factor has no defect, with the factor's own Jacobians."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from robots_to_compare import READY, ROBOTS, states
from scipy.integrate import solve_ivp

from jointscope.factors.calibration import Calibration
from jointscope.factors.euler_dynamics import EulerDynamics
from jointscope.factors.midpoint_dynamics import MidpointDynamics
from jointscope.factors.simpson_dynamics import SimpsonDynamics
from jointscope.factors.step import Steps
from jointscope.graphs.fixed_lag.window.step_noise import StepNoise
from jointscope.graphs.fixed_lag.window.tick_step import RatesAt, take_step, undivided_step
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.dynamics.state_rates import StateRates

FACTORS = {"simpson": SimpsonDynamics, "midpoint": MidpointDynamics, "euler": EulerDynamics}
CHOSEN = ("doggy", "doggy_paper", "friction on links", "joint 2 rigid", "bearing_flexibility", "hysteresis")
CHOSEN += ("torques that last",)
COUNT, H = 8, 1e-3


@pytest.fixture(scope="module", params=CHOSEN)
def robot(request):
    return ROBOTS[request.param]


@pytest.fixture(scope="module", params=FACTORS)
def rule(request):
    return request.param


def factor_of(robot, rule, x0, u, h=H):
    """The dynamics factor of steps that begin at x0, with the noise that a batch problem gives it."""
    weight = None
    if robot.noise.model == "integrated":
        M = robot.kinematic_tree.mass_matrix(x0[:, robot.layout.q_link])
        alone = 1.0 / np.diag(np.linalg.inv(robot.kinematic_tree.mass_matrix(np.zeros((1, M.shape[1])))[0]))
        weight = M / alone[:, None]
    steps = Steps(np.full(len(x0), h), u, robot.noise, robot.layout, weight)
    return FACTORS[rule](ElasticJoints(robot), steps, robot.joints)


def taken(robot, rule):
    model, x0 = StateRates(robot), states(robot, COUNT)
    u = np.random.default_rng(4).uniform(-0.5, 0.5, (COUNT, robot.n))
    return model, x0, u, [undivided_step(model, rule, x0[k], model.command_torque(u[k]), H) for k in range(COUNT)]


def test_the_end_of_a_step_leaves_the_factor_no_defect(robot, rule):
    _, x0, u, steps = taken(robot, rule)
    factor = factor_of(robot, rule, x0, u)
    defect = factor.residual((x0, np.array([step.x1 for step in steps])), Calibration.of(robot))
    # Newton's last change is below 5 % of what would bend the friction; against noise of some 0.01 rad/s in a step
    assert np.abs(defect[:, : robot.layout.n_rates]).max() < 2e-5
    assert np.abs(defect[:, robot.layout.n_rates :]).max() < 2e-8


def test_jacobians_are_those_of_the_factor(robot, rule):
    _, x0, u, steps = taken(robot, rule)
    factor = factor_of(robot, rule, x0, u)
    found = factor.linearize((x0, np.array([step.x1 for step in steps])), Calibration.of(robot))
    noise = StepNoise(robot)
    for k, step in enumerate(steps):
        T = noise.of_step(x0[k], H)[0]
        for own, by_state in ((step.by_start, found.by_state[0]), (step.by_end, found.by_state[1])):
            expected = by_state[k] / factor.sigmas[k][:, None]
            # derivatives are from the iterate before the last, a hundredth of a percent away where friction bends
            np.testing.assert_allclose(T @ own, expected, rtol=1e-5, atol=2e-3 * np.abs(expected).max())


def test_transition_and_torque_response_agree_with_differences(robot, rule):
    model, x0, u, steps = taken(robot, rule)
    exact = 1e-6
    for k, step in enumerate(steps[:3]):
        torque = model.command_torque(u[k])
        moved = np.empty_like(step.transition)
        for j in range(len(moved)):
            dx = np.zeros(len(moved))
            dx[j] = exact
            ends = [undivided_step(model, rule, x0[k] + s * dx, torque, H).x1 for s in (1.0, -1.0)]
            moved[:, j] = (ends[0] - ends[1]) / (2.0 * exact)
        np.testing.assert_allclose(step.transition, moved, atol=2e-2 * np.abs(moved - np.eye(len(moved))).max())
        response = step.by_end_inverse @ step.by_torque
        for j in range(robot.n):
            dt = np.zeros(robot.n)
            dt[j] = 1e-3
            ends = [undivided_step(model, rule, x0[k], torque + s * dt, H).x1 for s in (1.0, -1.0)]
            change = (ends[0] - ends[1]) / 2e-3
            np.testing.assert_allclose(response[:, j], change, atol=3e-2 * np.abs(change).max())


def test_a_step_in_which_dry_friction_turns_over_ends_where_many_short_ones_do():
    """Steps of 5 ms in which one motor comes to rest, or turns over; the rule alone misses a sixth of the friction."""
    sharp = replace(READY, choices=replace(READY.choices, friction_sharpness=1000.0))
    model, h, velocities = StateRates(sharp), 5e-3, READY.layout.velocities
    torque = model.command_torque(np.array([0.4, -0.3, 0.5]))
    errors = []
    for share in np.linspace(0.1, 0.9, 9):
        x0 = np.zeros(12)
        x0[READY.layout.motor_v] = x0[READY.layout.joint_v] = 0.5, 1e-9, -0.5
        x0[READY.layout.motor_v[1]] = -share * h * model.rates(x0, torque)[READY.layout.motor_v[1]]
        exact = solve_ivp(lambda _, x: model.rates(x, torque), (0.0, h), x0, "Radau", rtol=1e-9, atol=1e-12).y[:, -1]
        ways = take_step(model, "simpson", x0, torque, h), undivided_step(model, "simpson", x0, torque, h)
        errors.append([np.abs(step.x1 - exact)[velocities].max() for step in ways])
        halved = ways[0]
        small = 1e-7 * np.eye(12)
        ends = [[take_step(model, "simpson", x0 + s * dx, torque, h).x1 for dx in small] for s in (1.0, -1.0)]
        moved = ((np.array(ends[0]) - np.array(ends[1])) / 2e-7).T
        np.testing.assert_allclose(halved.transition, moved, atol=0.05 * np.abs(moved).max())
    found, alone = np.max(errors, axis=0)
    assert found < 0.15 * alone, (found, alone)


def test_rates_kept_from_the_last_step_change_the_end_less_than_noise():
    model, x0 = StateRates(READY), states(READY, COUNT)
    torque = model.command_torque(np.array([0.2, -0.1, 0.3]))
    sigma = READY.noise.motor_velocity.min() * np.sqrt(H)
    for x in x0:
        first = take_step(model, "simpson", x, torque, H)
        corrected = first.x1 + np.repeat([1e-5, 5e-4, 1e-5, 5e-4], 3)  # as far as samples move a tick
        fresh = take_step(model, "simpson", corrected, 1.1 * torque, H)
        kept = take_step(model, "simpson", corrected, 1.1 * torque, H, first.end)
        assert np.abs(fresh.x1 - kept.x1)[READY.layout.velocities].max() < 0.02 * sigma


def test_rates_are_evaluated_anew_where_friction_bends():
    model, x = StateRates(READY), np.zeros(12)
    torque = np.zeros(3)
    there = RatesAt.of(model, x, torque)
    x_far = x.copy()
    x_far[READY.layout.motor_v] = 0.02
    np.testing.assert_array_equal(there.near(model, x_far, torque).A, model.with_jacobian(x_far, torque)[1])
    x_near = x.copy()
    x_near[READY.layout.motor_v] = 1e-5
    assert there.near(model, x_near, torque).A is there.A


# noise


def test_whitening_and_its_inverse_are_inverse(robot):
    noise, x0 = StepNoise(robot), states(robot, 3)
    extra = np.random.default_rng(5).uniform(0.0, 0.1, robot.layout.n_rates)
    for x in x0:
        for own in (None, extra):
            T, G = noise.of_step(x, H, own)
            np.testing.assert_allclose(T @ G, np.eye(len(T)), atol=1e-9)


def test_whitening_is_that_of_the_factors(robot):
    x0 = states(robot, 4)
    factor = factor_of(robot, "simpson", x0, np.zeros((4, robot.n)))
    noise, layout = StepNoise(robot), robot.layout
    defect = np.random.default_rng(6).normal(size=(4, layout.size))
    rows = factor.steps.combine(defect[:, layout.rates], defect[:, layout.positions]) / factor.sigmas
    for k in range(4):
        np.testing.assert_allclose(noise.of_step(x0[k], H)[0] @ defect[k], rows[k], rtol=1e-10)


def test_noise_is_kept_for_near_postures_only():
    noise, x = StepNoise(READY), states(READY, 1)[0]
    first = noise.of_step(x, H)[0]
    near, far = x.copy(), x.copy()
    near[1] += 0.001
    far[1] += 0.5
    assert noise.of_step(near, H)[0] is first
    fresh = StepNoise(READY)
    np.testing.assert_allclose(noise.of_step(far, H)[0], fresh.of_step(far, H)[0], rtol=1e-12)
    np.testing.assert_allclose(noise.of_step(far, 2.0 * H)[0], fresh.of_step(far, 2.0 * H)[0], rtol=1e-12)
    near_again = noise.of_step(near, H)[0]
    exact = StepNoise(READY).of_step(near, H)[0]
    np.testing.assert_allclose(near_again, exact, rtol=1e-10, atol=1e-6 * np.abs(exact).max())


@pytest.mark.parametrize("rule", FACTORS)
def test_a_doubtful_torque_acts_throughout_a_step(rule):
    """A torque that is off all through a step of length h by as much moves the position by h/2 times the velocity."""
    robot, x, h = replace(READY, choices=replace(READY.choices, integrator=rule)), np.zeros(12), 1e-6
    noise, model = StepNoise(robot), StateRates(robot)
    extra = np.array([0.0, 0.0, 0.0, 0.05, 0.0, 0.0])  # [rad/s] on the motor of joint 1
    inverse = undivided_step(model, rule, x, np.zeros(3), h).by_end_inverse
    G0, G = (inverse @ noise.of_step(x, h, own)[1] for own in (None, extra))
    change = G @ G.T - G0 @ G0.T
    own = [robot.layout.q_motor.start, robot.layout.v_motor.start]
    expected = 0.05**2 * np.array([[h**2 / 4.0, h / 2.0], [h / 2.0, 1.0]])
    np.testing.assert_allclose(change[np.ix_(own, own)], expected, rtol=2e-3)


def test_independent_position_noise_is_kept_apart():
    robot = replace(READY, noise=replace(READY.noise, model="independent", position=1e-5))
    G = StepNoise(robot).of_step(np.zeros(12), H)[1]
    Q, layout = G @ G.T, robot.layout
    assert not Q[layout.positions][:, layout.velocities].any()
    np.testing.assert_allclose(np.sqrt(np.diag(Q))[layout.positions], 1e-5 * np.sqrt(H))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1e9, 1e150, 1e300])
def test_a_step_under_torques_of_no_robot_is_no_number_and_no_overflow(robot, rule, size):
    model, x0 = StateRates(robot), states(robot, 1)[0]
    step = take_step(model, rule, x0, size * np.array([1.0, -1.0, 1.0]), H)
    assert np.isnan(step.x1).all() and np.isnan(step.transition).all()
