# SPDX-License-Identifier: BSD-3-Clause
"""Where the estimator begins in the middle of a motion: velocities within their sigmas, and no wider than need be."""

from __future__ import annotations

import numpy as np
import pytest
from robots_to_compare import ROBOTS

from jointscope.graphs.fixed_lag.window.augmented_layout import AugmentedLayout
from jointscope.graphs.fixed_lag.window.first_state import ACCELERATION, EncoderSample, first_state
from jointscope.graphs.problem.bag_problem import DEFLECTION_SIGMA
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot

RIGID = ROBOTS["joint 2 rigid"]


def begun(times, motion, seed):
    encoder = RIGID.motor_encoder
    noise = encoder.sigmas * np.random.default_rng(seed).standard_normal((len(times), RIGID.n))
    q = motion(np.asarray(times)) + noise + np.asarray(encoder.zero)
    layout = AugmentedLayout(RIGID.layout, tuple(s.name for s in RIGID.biased), ())
    now, state = first_state(RIGID, layout, [EncoderSample(t, row) for t, row in zip(times, q, strict=True)], None)
    own = layout.robot
    return now, state.mean[own.motor_v], np.sqrt(np.diag(state.covariance)[own.motor_v])


@pytest.mark.parametrize("rate", [100.0, 250.0, 1000.0])
def test_velocities_of_accelerating_joints_are_within_their_sigmas(rate):
    a, v0 = np.array([3.0, -1.0, 0.5]), np.array([0.1, 0.0, -0.4])
    times = np.arange(max(5, round(0.021 * rate) + 1)) / rate
    for seed in range(20):
        now, v, sigma = begun(times, lambda t: v0 * t[:, None] + 0.5 * a * t[:, None] ** 2, seed)
        assert np.abs((v - v0 - a * now) / sigma).max() < 3.5
        assert sigma.max() < 0.5 * ACCELERATION * now


def test_two_samples_leave_the_acceleration_open():
    now, _, sigma = begun([0.0, 0.3], lambda t: np.array([0.2, 0.1, 0.3]) * t[:, None], 0)
    assert np.all(sigma >= 0.5 * ACCELERATION * now)


def resting(robot: Robot, q: np.ndarray):
    """Mean and covariance where encoders of motors stand still."""
    layout = AugmentedLayout(robot.layout, tuple(s.name for s in robot.biased), ())
    reading = q + np.asarray(robot.motor_encoder.zero)
    state = first_state(robot, layout, [EncoderSample(1e-3 * k, reading) for k in range(30)], None)[1]
    np.linalg.cholesky(state.covariance)
    return state.mean, state.covariance


def test_behind_an_encoder_with_play_a_motor_is_anywhere_in_it_and_the_reading_is_known():
    half = 5e-3
    robot = add_effect(load_robot("doggy"), "encoder_hysteresis@joint2", {"half_play": half})
    layout, sigma = robot.layout, robot.motor_encoder.sigmas[1]
    assert half > 50.0 * sigma
    mean, P = resting(robot, np.array([0.1, 0.2, 0.3]))
    motor, link, lag = layout.motor_q[1], layout.joint_q[1], layout.memory.start
    read = np.zeros(len(mean))
    read[motor], read[lag] = 1.0, -1.0
    assert read @ mean == pytest.approx(0.2) and np.sqrt(read @ P @ read) == pytest.approx(sigma)
    assert np.sqrt(P[motor, motor]) == pytest.approx(half, rel=1e-3)
    bent = np.zeros(len(mean))
    bent[link], bent[motor] = 1.0, -1.0
    assert np.sqrt(bent @ P @ bent) == pytest.approx(DEFLECTION_SIGMA)  # the link hangs on its motor, wherever that is
    assert np.sqrt(P[layout.motor_q[0], layout.motor_q[0]]) == pytest.approx(robot.motor_encoder.sigmas[0])


@pytest.mark.parametrize("robot", ["doggy", "biorob"])
def test_links_rest_within_dead_zones_as_their_motors_see_them_through_coupled_ropes(robot):
    slack = {"forward": 4e-3, "backward": 1e-3}
    robot = add_effect(load_robot(robot), "spring_slack@joint3", slack)
    layout, n = robot.layout, robot.n
    q = 0.1 * np.arange(1.0, n + 1.0)
    mean, P = resting(robot, q)
    T = np.eye(n) if robot.transmission is None else robot.transmission
    A, still = np.linalg.inv(T), np.zeros((1, n))
    weight = (T.T @ robot.tree.torque((T @ q)[None], still, still)[0])[2]
    if robot.name == "biorob":
        assert np.any(A[:, 2] * (np.arange(n) != 2))
    bent = np.zeros((n, len(mean)))
    bent[:, layout.joint_q] = A
    bent[np.arange(n), layout.motor_q] -= 1.0
    expected = np.zeros(n)
    expected[2] = 1.5e-3
    np.testing.assert_allclose(bent @ mean, expected, atol=1e-12)
    doubt = np.sqrt(np.diag(bent @ P @ bent.T))
    np.testing.assert_allclose(np.delete(doubt, 2), DEFLECTION_SIGMA, rtol=1e-6)
    assert doubt[2] == pytest.approx(np.hypot(2.5e-3, weight / robot.parameters["joint3.stiffness"].value))
    np.testing.assert_allclose(bent @ P @ bent.T, np.diag(doubt**2), atol=1e-9)
