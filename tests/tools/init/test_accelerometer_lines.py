# SPDX-License-Identifier: BSD-3-Clause
"""An IMU with an accelerometer gets lines to take the # away from; zeros are said to be none."""

from types import SimpleNamespace

import numpy as np
import pytest
from ruamel.yaml import YAML

from jointscope.tools.init.streams.signals import Signal
from jointscope.tools.init.text.accelerometer_text import accelerometer_lines


def lines(scale: float, gravity=(0.0, 0.0, -9.81), fast: float = 0.0) -> list[str]:
    rng = np.random.default_rng(1)
    values = scale * (np.array([0.0, 9.81, 0.0]) + 0.02 * rng.normal(size=(500, 3)))
    times = np.arange(500) * 1e-3
    values[120:] += scale * fast * np.sin(90.0 * times[120:, None])
    signal = Signal("/imu1/data", "sensor_msgs/msg/Imu", "linear_acceleration", (), times, values, True, "acceleration")
    gyro = SimpleNamespace(name="imu1", mount=SimpleNamespace(left_handed=False), acceleration=signal)
    return accelerometer_lines(gyro, gravity)


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "m/s^2"), (1.0 / 9.80665, "g")])
def test_the_unit_is_the_one_in_which_gravity_has_its_size(scale, unit):
    text = "\n".join(lines(scale))
    assert f"unit: {unit}" in text
    assert "imu1_acceleration.lever_z: {value: 0.0, unit: m, positive: false, prior_sigma: 0.1}" in text
    assert all(line.startswith("  #") for line in text.splitlines())
    assert "GUESS" not in text  # nothing of it counts yet


def test_fast_motion_does_not_hide_gravity():
    """Four fifths of the time its readings are far from gravity's size, as an arm in fast motion has them."""
    assert any("feels gravity in m/s^2" in line for line in lines(1.0, fast=40.0))
    assert any("feels gravity in g" in line for line in lines(1.0 / 9.80665, fast=40.0))


def test_what_remains_without_the_marks_is_a_section_of_a_robot_file():
    bare = "\n".join(line.replace("# ", "", 1) for line in lines(1.0) if line.startswith(("  # imu1", "  #   ")))
    section = YAML(typ="safe").load(bare)["imu1_acceleration"]
    assert section["kind"] == "accelerometer" and section["sigma"] == pytest.approx(0.02, rel=0.1)


def test_gravity_is_given_where_the_joints_do_not_feel_it():
    assert not any("gravity: [" in line for line in lines(1.0))
    assert any("gravity: [0.0, 0.0, -9.81]" in line for line in lines(1.0, (0.0, 0.0, 0.0)))


def test_zeros_are_no_accelerometer():
    assert lines(0.0) == ["  # no accelerometer on /imu1/data: linear_acceleration is zero"]


def test_a_size_that_no_unit_explains_is_said():
    assert "no unit makes that gravity" in lines(40.0)[0]
