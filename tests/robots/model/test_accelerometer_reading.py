# SPDX-License-Identifier: BSD-3-Clause
"""An accelerometer at one state, and what a robot file may say about one."""

import re

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.sensor_placement import factor_on_state
from jointscope.robots.errors import RobotError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.model.command_words import ready_robots
from jointscope.robots.model.readings_at_one_state import ReadingsAtOneState

SENSOR = """  acc:
    kind: accelerometer
    gyro: imu2
    topic: /imu2/data_raw
    type: sensor_msgs/msg/Imu
    field: linear_acceleration
    unit: g
    gravity: [0.0, 0.0, -9.81]
    sigma: 0.02
    bias: {value: [0.1, 0.0, 0.0], prior_sigma: 0.5}
"""
PLACE = "".join(f"  acc.lever_{a}: {{value: 0.05, unit: m, positive: false, prior_sigma: 0.1}}\n" for a in "xyz")


@pytest.fixture
def written(tmp_path):
    """Writes Doggy with an accelerometer, with some texts replaced."""
    source = ready_robots()["doggy"]

    def write(**changes: str):
        sensor, place = SENSOR, PLACE
        for old, new in changes.get("replace", ()):
            sensor, place = sensor.replace(old, new), place.replace(old, new)
        text = source.read_text().replace("urdf: doggy.urdf", f"urdf: {source.parent}/doggy.urdf")
        text = text.replace("\nparameters:", sensor + "\nparameters:", 1).replace("\nnoise:", place + "\nnoise:", 1)
        path = tmp_path / "doggy.yaml"
        path.write_text(text)
        return path

    return write


def test_the_reading_at_one_state_is_that_of_the_factor(written):
    robot = load_robot(written())
    readings, rng = ReadingsAtOneState(robot), np.random.default_rng(3)
    x = rng.normal(size=(4, robot.layout.size + robot.layout.n_link))
    factor = factor_on_state(robot, "acc", np.zeros((4, 3)), np.zeros(4))
    found = factor.linearize((x,), Calibration.of(robot))
    assert readings.feels_acceleration("acc") and not readings.feels_acceleration("imu2")
    for k in range(4):
        reading, J = readings.read("acc", x[k], 0.0)
        np.testing.assert_allclose(reading + robot.sensors["acc"].bias, found.residual[k], rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(J, found.by_state[0][k], rtol=1e-11, atol=1e-11)


def test_a_resting_accelerometer_feels_the_ground_push_it_up(written):
    robot = load_robot(written())
    x = np.zeros(robot.layout.size + robot.layout.n_link)
    reading = ReadingsAtOneState(robot).read("acc", x, 0.0)[0]
    R_base_body = robot.tree.body_poses("link3", np.zeros((1, 3)))[0][0]
    R_imu_body = next(g for g in robot.gyros if g.name == "imu2").R_imu_body
    np.testing.assert_allclose(reading, R_imu_body @ R_base_body.T @ [0.0, 0.0, 9.81], atol=1e-12)


def test_values_in_g_are_converted_when_they_are_read(written):
    assert load_robot(written()).sensors["acc"].source.factor == pytest.approx(9.80665)


def test_a_robot_file_with_an_accelerometer_is_written_and_read_again(written):
    path = written()
    robot = load_robot(path)
    text = robot_text(robot, path.parent)
    path.write_text(text)
    assert robot_text(load_robot(path), path.parent) == text


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("gyro: imu2", "gyro: imu9", "sensors.acc.gyro: expected the gyro of the same IMU (imu1, imu2), got 'imu9'"),
        ("unit: g", "unit: rad/s", "sensors.acc.unit: an accelerometer gives m/s^2 or g, got 'rad/s'"),
        ("    gravity: [0.0, 0.0, -9.81]\n", "", "add gravity: [0.0, 0.0, -9.81] to the sensor"),
        (
            "acc.lever_y",
            "acc.lefer_y",
            "parameters: 'acc.lever_y' is missing, where acc sits on link3; write acc.lever_y",
        ),
        ("positive: false", "positive: true", "parameters.acc.lever_x.positive: expected false"),
    ],
)
def test_what_is_wrong_with_an_accelerometer_is_said_with_what_to_write(written, old, new, message):
    with pytest.raises(RobotError, match=re.escape(message)):
        load_robot(written(replace=[(old, new)]))
