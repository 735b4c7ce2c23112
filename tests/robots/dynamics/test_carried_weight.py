# SPDX-License-Identifier: BSD-3-Clause
"""Laws that ask for the load of a joint find the weight where a joint is rigid."""

import numpy as np
import pytest

from jointscope.robots.dynamics.carried_weight import CarriedWeight
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.dynamics.law_at_one_state import JointLawsAtOneState
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

MASS, LENGTH, G = 0.49, 0.1, 9.81  # of the pendulum, as its source states them


@pytest.fixture(scope="module")
def loaded():
    return add_effect(load_robot("xl330_pendulum"), "load_dependent_friction@servo", {"coefficient": 0.3})


def named(robot):
    return {name: p.value for name, p in robot.parameters.items()}


def states(count=9):
    rng = np.random.default_rng(2)
    return np.column_stack([rng.uniform(-1.4, 1.4, count), rng.uniform(-2.0, 2.0, count)])


def test_the_weight_of_a_pendulum_is_that_of_its_mass(loaded):
    x = states()
    q = np.ravel(x[:, loaded.layout.q_link])
    found = CarriedWeight(loaded).torque(x, named(loaded))[:, 0]
    np.testing.assert_allclose(np.abs(found), MASS * G * LENGTH * np.abs(np.sin(q)), rtol=2e-3, atol=1e-4)


def test_robots_with_springs_or_without_gravity_carry_none():
    doggy = load_robot("doggy")
    assert not CarriedWeight(doggy).some
    assert not np.any(CarriedWeight(doggy).torque(np.zeros((3, doggy.layout.size)), named(doggy)))


def test_friction_grows_with_the_weight(loaded):
    model, plain = ElasticJoints(loaded), ElasticJoints(load_robot("xl330_pendulum"))
    layout = loaded.layout
    x = np.zeros((2, layout.size))
    x[1, layout.positions] = np.pi / 2
    x[:, layout.velocities] = 0.5
    u = np.zeros((2, 1))
    lost = [m.accelerations(x, u, np.array([r.parameters[n].value for n in m.names])) for m, r in ((model, loaded),)]
    base = plain.accelerations(x, u, np.array([loaded.parameters[n].value for n in plain.names]))
    braking = base - lost[0]
    assert braking[0, 0] == pytest.approx(0.0, abs=1e-6)  # hanging down, nothing presses on the gear
    assert braking[1, 0] > 1.0


def test_derivatives_are_those_of_differences(loaded):
    model = ElasticJoints(loaded)
    x, u = states(), np.full((9, 1), 0.1)
    p = np.array([loaded.parameters[name].value for name in model.names])
    exact = model.with_derivatives(x, u, p)
    for k in range(x.shape[1]):
        h = np.zeros(x.shape[1])
        h[k] = 1e-6
        slope = (model.accelerations(x + h, u, p) - model.accelerations(x - h, u, p)) / 2e-6
        np.testing.assert_allclose(exact.by_state[:, :, k], slope, rtol=1e-5, atol=1e-4)


def test_one_state_gives_the_same_as_many(loaded):
    x, layout = states(1), loaded.layout
    values = {name: parameter.value for name, parameter in loaded.parameters.items()}
    model = ElasticJoints(loaded)
    (here,) = loaded.effects
    law = JointLawsAtOneState([here], loaded, model.springs(x, values), values, loaded.friction_sharpness(values))
    tau, by_state = np.zeros(layout.n_rates), np.zeros((layout.n_rates, layout.size))
    law.add(x[0], tau, by_state)
    h = 1e-6
    for k in range(layout.size):
        up, down = np.zeros(layout.n_rates), np.zeros(layout.n_rates)
        step = np.zeros(layout.size)
        step[k] = h
        law.add(x[0] + step, up, None)
        law.add(x[0] - step, down, None)
        np.testing.assert_allclose(by_state[:, k], (up - down) / (2 * h), rtol=1e-5, atol=1e-6)
    many = model.accelerations(x, np.zeros((1, 1)), np.array([values[n] for n in model.names]))
    without = ElasticJoints(load_robot("xl330_pendulum"))
    base = without.accelerations(x, np.zeros((1, 1)), np.array([values[n] for n in without.names]))
    inertia = without.tree.bodies(values).mass_matrix(x[:, layout.q_link])[0, 0, 0]
    np.testing.assert_allclose(many - base, [[tau[0] / inertia]], rtol=1e-6)


def test_behind_springs_and_ropes_the_weight_is_that_in_motor_coordinates():
    robot = load_robot("biorob")
    x = np.zeros((2, robot.layout.size))
    x[1, robot.layout.joint_q] = 0.1, -0.4, 0.7, 0.3
    values = named(robot)
    found = CarriedWeight(robot).torque(x, values)
    # stretched out, Table 2 and Table 1 of the paper: rope 3 feels what joint 4 carries, through the idler
    b3, b4, b5 = 0.80249, 0.7541, 0.1393
    idler = -0.0121 / 0.0306 * 0.012 / 0.025
    on_ropes = [0.09152 * 79 / 245, (b3 + b4 + b5) * 121 / 403, (b4 + b5) * 121 / 306 + idler * b5, b5 * 9 / 25]
    np.testing.assert_allclose(found[0], -np.array(on_ropes), rtol=1e-6)
    pulling = CarriedWeight(robot).torque(x, values, np.array([[0.0, 0.0, 0.0, 2.0]] * 2)) - found
    np.testing.assert_allclose(pulling, [[0.0, 0.0, 2.0 * idler, 2.0 * 9 / 25]] * 2, atol=1e-12)


def test_derivatives_with_the_weight_behind_ropes_are_those_of_differences():
    robot = load_robot("biorob")
    model, layout = ElasticJoints(robot), robot.layout
    rng = np.random.default_rng(4)
    x, u = 0.3 * rng.normal(size=(5, layout.size)), rng.normal(size=(5, 4))
    p = np.array([robot.parameters[name].value for name in model.names]) + 0.01
    exact = model.with_derivatives(x, u, p)
    for k in range(layout.size):
        h = np.zeros(layout.size)
        h[k] = 1e-7
        slope = (model.accelerations(x + h, u, p) - model.accelerations(x - h, u, p)) / 2e-7
        np.testing.assert_allclose(exact.by_state[:, :, k], slope, rtol=1e-4, atol=2e-3)
    for k in range(len(p)):
        h = np.zeros(len(p))
        h[k] = 1e-6 * max(1.0, abs(p[k]))
        slope = (model.accelerations(x, u, p + h) - model.accelerations(x, u, p - h)) / (2 * h[k])
        np.testing.assert_allclose(exact.by_parameter[:, :, k], slope, rtol=1e-4, atol=2e-3, err_msg=model.names[k])
