# SPDX-License-Identifier: BSD-3-Clause
"""A value that contradicts its prior is never silently good, and the verdict says what it likely is."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from fake_results import fake_calibration

from jointscope.factors.calibration import bias_block
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.sensors import Accelerometer
from jointscope.tools.verdicts.judgement import judge
from jointscope.tools.verdicts.priors.far_from_priors import FAR, NAME, far_from_priors, far_parameters


@pytest.fixture(scope="module")
def good():
    return fake_calibration()


def with_value(result, name, value, **changes):
    parameters = tuple(
        dataclasses.replace(p, value=value, **changes) if p.name == name else p for p in result.parameters
    )
    return dataclasses.replace(result, parameters=parameters)


def answer(result):
    return next(check for check in judge(result).checks if check.name == NAME)


def test_values_near_their_priors_are_good(good):
    assert answer(good).level == "good"


@pytest.mark.parametrize(("sigmas", "level"), [(0.9, "good"), (1.1, "warn"), (2.1, "bad")])
def test_the_logarithm_of_a_positive_value_is_counted_in_its_priors_sigmas(good, sigmas, level):
    stiffness = next(p for p in good.parameters if p.name == "joint2.stiffness")
    value = stiffness.prior * np.exp(FAR[0] * sigmas * 0.01)
    assert far_from_priors(with_value(good, "joint2.stiffness", value, prior_sigma=0.01 * stiffness.prior))[0] == level


def test_the_sentence_says_what_was_found_what_was_expected_and_what_to_do(good):
    check = answer(with_value(good, "imu2.R_imu_body.x", 3.1))
    assert check.level == "bad"
    for said in ("imu2.R_imu_body.x is 3.1", "31 sigma from its prior of 0 ± 0.1", "turned otherwise", "prior_sigma"):
        assert said in check.text


def test_the_bias_of_every_recording_is_looked_at(good):
    bag = good.bags[0]
    moved = bag.calibration.retract({bias_block("imu1"): np.array([0.0, 2.0, 0.0])})
    wrong = dataclasses.replace(bag, calibration=moved)
    level, text = far_from_priors(dataclasses.replace(good, bags=(bag, wrong)))
    assert level == "bad" and text.startswith("imu1.bias.y (bag 2) is 2.00 rad/s, 20 sigma from its prior of")
    assert "another unit" in text


def test_parameters_of_other_kinds_are_looked_at_as_well():
    offset = Parameter("tracker.lx", 0.9, "m", 0.0, 0.01, positive=False, sigma=1e-4)
    level, text = far_parameters({"tracker.lx": offset}, ["tracker.lx"], "arm.yaml")
    assert level == "bad" and "90 sigma from its prior" in text and "Correct tracker in arm.yaml" in text


@pytest.fixture(scope="module")
def felt():
    """Two seconds of a Doggy with an accelerometer on the link that turns about the vertical, and a file's gravity."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    doggy = load_robot("doggy")
    source = dataclasses.replace(doggy.sensors["imu1"].source, field="linear_acceleration", unit="m/s^2")

    def robot(gravity):
        sensor = Accelerometer("acc", source, "imu1", 0.02, np.zeros(3), 0.1, gravity=np.array(gravity))
        lever = {name: Parameter(name, 0.0, "m", 0.0, 0.1, positive=False) for name in sensor.lever}
        sensors, parameters = {**doggy.sensors, "acc": sensor}, {**doggy.parameters, **lever}
        return dataclasses.replace(doggy, sensors=sensors, parameters=parameters)

    made = simulate(robot([0.0, 0.0, -9.81]), "calibration", 2.0, seed=3, friction="smooth")
    return lambda gravity: judge(calibrate(robot(gravity), [made.recording]))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("gravity", "said"),
    [
        ([0.0, 0.0, 9.81], "acc feels gravity the other way than the robot file says"),
        ([0.0, 6.94, -6.94], "acc feels gravity along another axis than the robot file says"),
        ([0.0, 0.0, -1.0], "acc feels gravity of another size than the robot file says"),
    ],
)
def test_gravity_that_an_accelerometer_does_not_feel_is_told_from_its_bias(felt, gravity, said):
    judgement = felt(gravity)
    check = next(check for check in judgement.checks if check.name == NAME)
    assert judgement.level == check.level == "bad"
    assert "acc.bias." in check.text and said in check.text
    asked = re.search(r"write `gravity: \[(.*?)\]`", check.text)
    found = np.array([float(element) for element in asked[1].split(",")])
    np.testing.assert_allclose(found, [0.0, 0.0, -9.81], atol=0.3)  # three sigma of the bias's prior


@pytest.mark.slow
def test_gravity_as_it_is_felt_is_not_doubted(felt):
    judgement = felt([0.0, 0.0, -9.81])
    assert next(check for check in judgement.checks if check.name == NAME).level == "good", judgement.answer
