# SPDX-License-Identifier: BSD-3-Clause
"""Adapted parameters walk to the truth and say how sure they are; the covariance of the rest includes them."""

from __future__ import annotations

import numpy as np
import pytest
from online_doggy import feed

from jointscope.graphs.fixed_lag import FixedLagEstimator

WRONG = {"joint2.coulomb_torque": (0.8, 0.02), "motor.k_pwm": (0.8, 0.05), "joint1.stiffness": (1.2, 2.0)}


@pytest.mark.parametrize("name", WRONG)
def test_a_parameter_that_is_20_percent_off_walks_to_the_truth(run, name):
    share, density = WRONG[name]
    true = run.robot.parameters[name].value
    robot = run.robot.with_values({name: share * true})
    est, found, nees = FixedLagEstimator(robot, 0.1, adapt={name: density}), [], []

    def look(t):
        if t > 0.8:
            state = est.state()
            found.append(state.parameters[name])
            nees.append(run.nees(state))

    feed(est, run.messages(0.4, 1.2), look)
    value, sigma = np.array(found).T
    assert np.all(np.abs(value - true) < 4.0 * sigma)
    assert np.sqrt(np.mean(((value - true) / sigma) ** 2)) < 2.5
    assert abs(value[-1] - true) < 0.05 * true and sigma[-1] < 0.05 * true
    assert np.mean(nees) < 2.0


def test_without_adaptation_the_wrong_parameter_raises_an_alarm(run):
    name = "motor.k_pwm"
    robot = run.robot.with_values({name: 0.8 * run.robot.parameters[name].value})
    est = feed(FixedLagEstimator(robot, 0.1), run.messages(0.45, 1.2))
    assert est.status.alarms
    assert "alarm" in {event.kind for event in est.events}
    adapted = feed(FixedLagEstimator(robot, 0.1, adapt={name: 0.05}), run.messages(0.45, 1.2))
    assert not adapted.status.alarms


def test_adapted_parameters_survive_a_new_beginning(run):
    name = "motor.k_pwm"
    true = run.robot.parameters[name].value
    est = FixedLagEstimator(run.robot.with_values({name: 0.8 * true}), 0.1, adapt={name: 0.05})
    feed(est, run.messages(0.45, 0.75))
    feed(est, run.messages(1.2, 1.25))
    assert est.status.restarts == 1 and est.status.running
    assert est.state().parameters[name][0] == pytest.approx(true, rel=0.02)
