# SPDX-License-Identifier: BSD-3-Clause
"""Accelerometers of IMUs on a simulated Doggy; what they feel is the reading of MuJoCo's own sensor."""

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.comparison.compare import smooth
from jointscope.graphs.screening.screen_all import screen_all
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.sensors import Accelerometer

pytestmark = pytest.mark.slow

TRUE_PLACE = np.array([0.05, -0.03, 0.08])  # [m]


@pytest.fixture(scope="module")
def robot():
    """Doggy with an accelerometer on its last IMU, some centimetres away from where it is thought to be."""
    doggy = load_robot("doggy")
    source = replace(doggy.sensors["imu2"].source, field="linear_acceleration", unit="m/s^2")
    sensor = Accelerometer("acc", source, "imu2", 0.02, np.zeros(3), 0.5, gravity=np.array([0.0, 0.0, -9.81]))
    places = [
        Parameter(name, 0.0, "m", 0.0, 0.1, positive=False, published=float(p))
        for name, p in zip(sensor.lever, TRUE_PLACE, strict=True)
    ]
    parameters = {**doggy.parameters, **{p.name: p for p in places}}
    return replace(doggy, sensors={**doggy.sensors, "acc": sensor}, parameters=parameters)


@pytest.fixture(scope="module")
def made(robot):
    """Two seconds of motion."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    return simulate(robot, "calibration", 2.0, seed=3, friction="smooth")


@pytest.fixture(scope="module")
def result(robot, made):
    return calibrate(robot, [made.recording])


def test_all_values_are_within_their_sigmas_of_the_truth(result, made):
    truth = made.truth["parameters"]
    found = {name: p for name, p in result.robot.parameters.items() if not p.fixed}
    away = {name: (p.value - truth[name]) / p.sigma for name, p in found.items()}
    sensor = result.robot.sensors["acc"]
    away |= {f"bias.{i}": e for i, e in enumerate((sensor.bias - truth["acc.bias"]) / sensor.bias_sigma)}
    assert max(map(abs, away.values())) < 3.5, away
    assert all(found[name].sigma < 1e-4 for name in sensor.lever)  # 0.1 mm


def test_its_channels_are_no_more_than_noise(result):
    assert all(0.8 < result.channels[channel].chi2 < 1.2 for channel in result.robot.sensors["acc"].channels)


def test_its_values_are_in_the_json_as_they_stand_in_the_robot_file(result):
    parameters = result.to_json()["parameters"]
    assert parameters["acc.lever_x"]["unit"] == "m"
    assert parameters["acc.bias"]["unit"] == "m/s^2" and len(parameters["acc.bias"]["value"]) == 3


def test_springs_and_dampers_are_known_better_with_it(result, robot, made):
    alone = calibrate(robot.without(robot.accelerometers), [made.recording]).robot.parameters
    shares = {name: result.robot.parameters[name].sigma / p.sigma for name, p in alone.items() if not p.fixed}
    assert all(share < 1.001 for share in shares.values()), shares
    # little: gyroscopes and encoders of a recording without random torques say nearly all
    assert shares["joint2.stiffness"] < 0.995 and shares["joint2.damping"] < 0.998


def test_states_to_compare_are_smoothed_with_it(result, made):
    problem, states, calibration = smooth(result.robot, made.recording)
    assert set(problem.robot.sensors) == {"motor_encoder", "imu1", "imu2", "acc"}
    assert np.all(np.abs(calibration.biases["acc"] - made.truth["parameters"]["acc.bias"]) < 0.01)  # [m/s^2]
    assert len(states) == len(problem.timeline.ticks)


@pytest.mark.parametrize(
    ("factor", "message"),
    [
        (1.0 / 9.80665, r"values look like g: set `unit` of sensors.acc in the robot file \(now m/s\^2\) to g"),
        (0.0, r"the IMU on /imu2/data_raw has no accelerometer; remove sensors.acc"),
    ],
)
def test_a_wrong_unit_or_an_imu_without_accelerometer_is_said_in_one_line(robot, made, factor, message):
    stream = made.recording.streams["acc"]
    streams = {**made.recording.streams, "acc": replace(stream, values=stream.values * factor)}
    with pytest.raises(RecordingError, match=message):
        screen_all(replace(made.recording, streams=streams), robot)
