# SPDX-License-Identifier: BSD-3-Clause
"""Motors that stick and slip: they hold, they break away, and slip as a plain simulation with tiny steps says."""

import numpy as np
import pytest

from jointscope.graphs.comparison.stick_slip import StickSlip
from jointscope.robots.files.robot_file import load_robot

H = 2e-3


@pytest.fixture(scope="module")
def robot():
    """BioRob with friction that does not depend on weight, so that a test can write it down."""
    arm = load_robot("biorob")
    zero = {f"joint{i}.weight_dependent_friction.{p}": 0.0 for i in range(1, 5) for p in ("coefficient", "quadratic")}
    return arm.with_values(zero)


def hanging(robot, v_motor=0.0):
    """Stretched out downwards, where gravity nearly vanishes, motors at rest or all at one velocity, shape (1, d)."""
    x = np.zeros((1, robot.layout.size))
    q = np.array([0.0, -np.pi / 2, 0.0, 0.0])
    x[:, robot.layout.q_link] = q
    x[:, robot.layout.q_motor] = np.linalg.solve(robot.transmission, q)
    x[:, robot.layout.v_motor] = v_motor
    return x


def friction(robot):
    return np.array([robot.drive_parameter(joint, "coulomb_torque").value for joint in robot.joints])


def test_a_motor_under_less_torque_than_its_friction_stays_where_it_is(robot):
    x, steps = hanging(robot), StickSlip(robot, H)
    before = x[:, robot.layout.q_motor].copy()
    torque = 0.3 * friction(robot)[None]
    for _ in range(100):
        x = steps.advance(x, torque, np.full((1, 1), H))
    np.testing.assert_array_equal(x[:, robot.layout.q_motor], before)
    np.testing.assert_array_equal(x[:, robot.layout.v_motor], 0.0)


def test_a_motor_under_more_torque_than_its_friction_breaks_away_to_the_side_of_the_torque(robot):
    steps = StickSlip(robot, H)
    for side in (1.0, -1.0):
        x = steps.advance(hanging(robot), side * 3.0 * friction(robot)[None], np.full((1, 1), H))
        assert np.all(side * x[:, robot.layout.v_motor] > 0.0)


def test_a_motor_that_runs_out_stops_and_does_not_turn_back(robot):
    x, steps = hanging(robot, 0.05), StickSlip(robot, H)
    x = steps.advance(x, np.zeros((1, robot.n)), np.full((1, 1), H))
    np.testing.assert_array_equal(x[:, robot.layout.v_motor], 0.0)


def test_a_slipping_motor_goes_as_a_simulation_by_plain_small_steps(robot):
    """Motor 1 alone: b a = k_pwm u - k_mi v - mu + spring; link and spring hardly move in the time it takes."""
    torque = np.zeros((1, robot.n))
    torque[0, 0] = 0.4
    x, steps = hanging(robot), StickSlip(robot, H)
    for _ in range(3):
        x = steps.advance(x, torque, np.full((1, 1), H))
    b, k_mi, mu, K, D = (
        robot.drive_parameter("joint1", name).value
        for name in ("inertia", "k_mi", "coulomb_torque", "stiffness", "damping")
    )
    q, v, dt = 0.0, 0.0, 1e-7
    for _ in range(round(3 * H / dt)):
        v += dt / b * (torque[0, 0] - k_mi * v - mu - K * q - D * v)
        q += dt * v
    found = x[0, robot.layout.q_motor][0], x[0, robot.layout.v_motor][0]
    np.testing.assert_allclose(found, (q, v), rtol=2e-3)


@pytest.mark.parametrize("back", [-0.02, -0.4, -1.5])
def test_a_motor_that_is_turned_round_within_a_step_goes_as_by_plain_small_steps(robot, back):
    """Behind a jump of its command; the others keep their way, and so does the next state of many."""
    torque = np.zeros((2, robot.n))
    torque[0, 0] = 3.0
    x = np.vstack([hanging(robot, 0.3), hanging(robot, 0.3)])
    x[0, robot.layout.v_motor] = [back, 0.3, 0.3, 0.3]
    b, k_mi, mu, K, D = (
        robot.drive_parameter("joint1", name).value
        for name in ("inertia", "k_mi", "coulomb_torque", "stiffness", "damping")
    )
    q, v, dt = 0.0, back, 1e-7
    for _ in range(round(H / dt)):
        v += dt / b * (torque[0, 0] - k_mi * v - mu * np.sign(v) - K * q - D * v)
        q += dt * v
    after = StickSlip(robot, H).advance(x, torque, np.full((2, 1), H))
    assert v > 3.0
    found = after[0, robot.layout.q_motor][0], after[0, robot.layout.v_motor][0]
    np.testing.assert_allclose(found, (q, v), rtol=5e-3)
    alone = StickSlip(robot, H).advance(x[1:], torque[1:], np.full((1, 1), H))
    np.testing.assert_allclose(after[1], alone[0], rtol=1e-12)
    np.testing.assert_allclose(after[0, robot.layout.v_motor][1:], alone[0, robot.layout.v_motor][1:], rtol=1e-3)
