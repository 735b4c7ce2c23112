# SPDX-License-Identifier: BSD-3-Clause
"""Torque sensors in the elastic joints of a simulated Doggy; they say what MuJoCo's inverse dynamics does."""

from dataclasses import replace

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.base_model import BaseModel
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.comparison.compare import compare_model
from jointscope.graphs.fixed_lag.replay.replay import replay
from jointscope.graphs.problem.sensor_placement import factor_on_state
from jointscope.robots.dynamics.spring_torques import torque_reading
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.sensors import TorqueSensor
from jointscope.robots.recordings.screening import screen
from jointscope.tools.verdicts.judgement import judge

TRUE = {"torque.scale_joint1": 1.08, "torque.offset_joint2": 0.7}
SIGMA = 0.05  # [N m]


@pytest.fixture(scope="module")
def robot():
    """Doggy with torque sensors, of which one has an unknown scale and one an unknown offset."""
    doggy = load_robot("doggy")
    source = replace(doggy.motor_encoder.source, topic="/torques", field="effort", unit="N m")
    sensor = TorqueSensor("torque", source, SIGMA, doggy.joints)
    own = [
        Parameter("torque.scale_joint1", 1.0, "1", 1.0, 0.2),
        Parameter("torque.offset_joint2", 0.0, "N m", 0.0, 2.0, positive=False),
    ]
    parameters = {**doggy.parameters, **{p.name: p for p in own}}
    return replace(doggy, sensors={**doggy.sensors, "torque": sensor}, parameters=parameters)


@pytest.fixture(scope="module")
def made(robot):
    """Two seconds of motion."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    return simulate(robot, "calibration", 2.0, seed=3, friction="smooth", parameters=TRUE)


@pytest.fixture(scope="module")
def result(robot, made):
    return calibrate(robot, [made.recording])


def test_scale_offset_and_all_values_are_within_their_sigmas_of_the_truth(result, made):
    truth = {**made.truth["parameters"], **TRUE}
    found = {name: p for name, p in result.robot.parameters.items() if not p.fixed}
    assert set(TRUE) <= set(found)
    for name, p in found.items():
        assert abs(p.value - truth[name]) < 4.0 * p.sigma, (name, p.value, truth[name], p.sigma)
    assert found["torque.scale_joint1"].sigma < 1e-3
    assert found["torque.offset_joint2"].sigma < 5e-3


def test_its_residuals_have_the_size_of_its_noise(result):
    for joint in result.robot.joints:
        assert result.channels[f"{joint}.joint_torque"].chi2 == pytest.approx(1.0, abs=0.1)


def test_the_robot_without_it_agrees_and_holds_what_was_its_own(robot, made, result):
    plain = robot.without([robot.torque_sensor])
    assert plain.parameters["torque.scale_joint1"].fixed and "torque" not in plain.sensors
    alone = calibrate(plain, [made.recording]).robot.parameters["joint2.stiffness"]
    found = result.robot.parameters["joint2.stiffness"]
    assert abs(found.value - alone.value) < 4.0 * np.hypot(found.sigma, alone.sigma)


def test_derivatives_are_those_of_the_residual_with_effects_in_the_springs(robot):
    rng = np.random.default_rng(2)
    for label, sizes in (("spring_cubic@joint1", {"stiffness": 900.0}), ("backlash@joint2", {"half_gap": 0.01})):
        full = add_effect(robot, label, sizes)
        calibration = Calibration.of(full)
        x = 0.05 * rng.normal(size=(4, full.layout.size))
        factor = factor_on_state(full, "torque", rng.normal(size=(4, 3)), np.zeros(4))
        linear = factor.linearize((x,), calibration)
        for i in range(full.layout.size):
            step = np.zeros(full.layout.size)
            step[i] = 1e-6
            slope = (factor.residual((x + step,), calibration) - factor.residual((x - step,), calibration)) / 2e-6
            np.testing.assert_allclose(linear.by_state[0][:, :, i], slope, rtol=1e-5, atol=1e-5)
        for i, name in enumerate(calibration.names):
            step = np.zeros(len(calibration.names))
            step[i] = 1e-6
            ends = (factor.residual((x,), calibration.retract({"dynamics": s * step})) for s in (1.0, -1.0))
            slope = np.subtract(*ends) / 2e-6
            np.testing.assert_allclose(linear.by_block["dynamics"][:, :, i], slope, rtol=1e-5, atol=1e-6, err_msg=name)


def test_the_reading_at_one_state_is_that_of_the_factor(robot):
    x = 0.1 * np.random.default_rng(4).normal(size=(3, robot.layout.size))
    linear = factor_on_state(robot, "torque", np.zeros((3, 3)), np.zeros(3)).linearize((x,), Calibration.of(robot))
    for k in range(3):
        reading, J = torque_reading(robot)(x[k])
        np.testing.assert_allclose(reading, linear.residual[k], rtol=1e-12)
        np.testing.assert_allclose(J, linear.by_state[0][k], rtol=1e-12)


def test_the_estimator_takes_it_and_stays_consistent(result, made):
    found = replay(result.robot, made.recording)
    assert 0.8 < found.nis_mean < 1.25


def test_predictions_of_torques_have_errors_near_their_floors(result, made):
    comparison = compare_model("calibrated", result.robot, made.recording)
    for joint in result.robot.joints:
        channel = f"{joint}.joint_torque"
        assert comparison.channels[channel].horizons["0.01"] < 3.0 * comparison.floors[channel] * SIGMA


def test_a_diagnosis_goes_without_it(robot, made):
    assert BaseModel.of(robot, [made.recording]).robot.torque_sensor is None


def test_a_sensor_that_says_nothing_is_refused_in_one_line(robot, made):
    stream = made.recording.streams["torque"]
    dead = replace(stream, values=np.zeros_like(stream.values))
    with pytest.raises(RecordingError, match="joint_torque never changes"):
        screen(replace(made.recording, streams={**made.recording.streams, "torque": dead}), robot)


def test_a_scale_and_an_offset_that_the_robot_file_lacks_are_named(robot, made, result):
    assert result.torque_readings == ()
    plain = replace(robot, parameters={n: p for n, p in robot.parameters.items() if n not in TRUE})
    found = calibrate(plain, [made.recording])
    told = {one.parameter: one for one in found.torque_readings}
    assert set(told) >= set(TRUE) and abs(told["torque.offset_joint2"].value - 0.7) < 0.2
    judgement = judge(found)
    assert judgement.level == "bad"
    assert "Torque sensors as the robot file has them" in judgement.answer
    assert "`torque.offset_joint2: {value: 0.0, unit: N m, positive: false, prior_sigma: 3}`" in judgement.answer
