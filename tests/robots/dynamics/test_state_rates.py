# SPDX-License-Identifier: BSD-3-Clause
"""The motion of one state at a time is that of the equations for many samples, to rounding, for every effect."""

from __future__ import annotations

import numpy as np
import pytest
from robots_to_compare import READY, ROBOTS, states

from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.dynamics.state_rates import StateRates
from jointscope.robots.effect_kinds.joint_torque import JointTorque
from jointscope.robots.errors import EffectError
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

COUNT = 12


@pytest.fixture(scope="module", params=ROBOTS, ids=lambda name: name.replace(" ", "_"))
def compared(request):
    """A robot, states, commands, and what the equations for many samples say."""
    robot = ROBOTS[request.param]
    joints, x = ElasticJoints(robot), states(robot, COUNT)
    u = np.random.default_rng(4).uniform(-1.0, 1.0, (COUNT, robot.n))
    values = np.array([robot.parameters[name].value for name in joints.names])
    return robot, joints, x, u, values, joints.with_derivatives(x, u, values)


def test_rates_are_those_of_the_elastic_joints(compared):
    robot, _, x, u, _, expected = compared
    model, layout = StateRates(robot), robot.layout
    for k in range(COUNT):
        torque = model.command_torque(u[k])
        for rate in (model.rates(x[k], torque), model.with_jacobian(x[k], torque)[0]):
            np.testing.assert_allclose(rate[layout.rates], expected.value[k], rtol=1e-10, atol=1e-9)
            np.testing.assert_array_equal(rate[layout.positions], x[k, layout.velocities])


def test_derivatives_by_the_state_are_those_of_the_elastic_joints(compared):
    robot, _, x, u, _, expected = compared
    model, layout = StateRates(robot), robot.layout
    for k in range(COUNT):
        A = model.with_jacobian(x[k], model.command_torque(u[k]))[1]
        scale = np.abs(expected.by_state[k]).max()
        np.testing.assert_allclose(A[layout.rates], expected.by_state[k], rtol=1e-9, atol=1e-11 * scale)


def test_derivatives_by_the_torque_give_the_response_to_commands(compared):
    robot, joints, x, u, values, expected = compared
    model, layout = StateRates(robot), robot.layout
    response = joints.command_response(expected, values)
    for k in range(COUNT):
        C = model.with_jacobian(x[k], model.command_torque(u[k]))[2]
        gain = model.command_torque(np.ones(robot.n))
        np.testing.assert_allclose(C[layout.rates] * gain, response[k], rtol=1e-10, atol=1e-12)
        assert not C[layout.positions].any()


@pytest.mark.parametrize("scale", [-0.2, 0.0, 0.37, 0.998, 1.0, 1.3])
@pytest.mark.parametrize("name", ["coriolis", "mimic joints and coriolis"])
def test_any_share_of_the_coriolis_terms_gives_the_same_as_many_samples_and_the_right_slopes(name, scale):
    robot = ROBOTS[name].with_values({"robot.coriolis.scale": scale})
    joints, layout = ElasticJoints(robot), robot.layout
    x, u = states(robot, COUNT), np.random.default_rng(5).uniform(-1.0, 1.0, (COUNT, robot.n))
    x[:, layout.v_link] += 1.5  # fast enough for the terms to matter
    values = np.array([robot.parameters[name].value for name in joints.names])
    expected = joints.with_derivatives(x, u, values)
    model = StateRates(robot)
    for k in range(COUNT):
        torque = model.command_torque(u[k])
        rate, A, _ = model.with_jacobian(x[k], torque)
        np.testing.assert_allclose(rate, model.rates(x[k], torque), rtol=1e-10, atol=1e-9)
        np.testing.assert_allclose(rate[layout.rates], expected.value[k], rtol=1e-10, atol=1e-9)
        largest = np.abs(expected.by_state[k]).max()
        np.testing.assert_allclose(A[layout.rates], expected.by_state[k], rtol=1e-9, atol=1e-11 * largest)
        for column in np.r_[np.arange(layout.size)[layout.q_link], np.arange(layout.size)[layout.v_link]]:
            step = 1e-6 * np.eye(layout.size)[column]
            slope = (model.rates(x[k] + step, torque) - model.rates(x[k] - step, torque)) / 2e-6
            np.testing.assert_allclose(A[:, column], slope, rtol=1e-5, atol=1e-7 * largest)


def test_calls_do_not_disturb_each_other(compared):
    robot, _, x, u, _, _ = compared
    model = StateRates(robot)
    torque = model.command_torque(u[0])
    before = [part.copy() for part in model.with_jacobian(x[0], torque)]
    kept = model.with_jacobian(x[0], torque)
    model.with_jacobian(x[1], torque)
    model.rates(x[2], torque)
    for first, held in zip(before, kept, strict=True):
        np.testing.assert_array_equal(first, held)


def test_other_values_are_used_instead_of_the_robots_own():
    name = "joint1.coulomb_torque"
    changed = READY.with_values({name: 1.3 * READY.parameters[name].value, "motor.k_pwm": 3.0})
    x = states(READY, 1)[0]
    given = StateRates(READY, {name: changed.parameters[name].value, "motor.k_pwm": 3.0})
    own = StateRates(changed)
    u = np.array([0.2, -0.3, 0.4])
    np.testing.assert_array_equal(given.command_torque(u), own.command_torque(u))
    np.testing.assert_array_equal(given.rates(x, given.command_torque(u)), own.rates(x, own.command_torque(u)))


LAWS = [e for e in catalogue().values() if isinstance(e, JointTorque)]
PLACES = {"doggy": ("joint1", "joint3"), "biorob": ("joint2", "joint4")}


@pytest.mark.parametrize("effect", LAWS, ids=lambda effect: effect.id)
@pytest.mark.parametrize("name", PLACES)
def test_a_law_at_two_joints_is_evaluated_side_by_side_as_if_alone(name, effect):
    robot, rng = load_robot(name), np.random.default_rng(8)
    for joint in PLACES[name]:
        if effect.id not in {here.effect.id for here in robot.effects if here.owner == joint}:
            try:
                robot = add_effect(robot, f"{effect.id}@{joint}")
            except EffectError as err:
                pytest.skip(str(err))
    own = [n for n, p in robot.parameters.items() if p.effect and n.split(".")[1] == effect.id]
    sized = {n: effect.example.get(n.split(".")[2], 0.1) * rng.uniform(0.5, 1.5) for n in own}
    robot = robot.with_values({n: v for n, v in sized.items() if not n.endswith("order")})
    joints, model, x = ElasticJoints(robot), StateRates(robot), states(robot, COUNT)
    u = rng.uniform(-1.0, 1.0, (COUNT, robot.n))
    expected = joints.with_derivatives(x, u, np.array([robot.parameters[n].value for n in joints.names]))
    for k in range(COUNT):
        rate, A, _ = model.with_jacobian(x[k], model.command_torque(u[k]))
        most = np.abs(expected.value[k]).max()
        np.testing.assert_allclose(rate[robot.layout.rates], expected.value[k], rtol=1e-10, atol=1e-9 + 1e-14 * most)
        scale = np.abs(expected.by_state[k]).max()
        np.testing.assert_allclose(A[robot.layout.rates], expected.by_state[k], rtol=1e-9, atol=1e-11 * scale)
