# SPDX-License-Identifier: BSD-3-Clause
"""An accelerometer of a simulated Doggy with one plain mistake in it: named, with what to write; a right one is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.screening.felt_gravity import FELT_GRAVITY
from jointscope.graphs.screening.screen_all import PLAIN_MISTAKES, screen_all
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.sensors import Accelerometer

G = 9.80665
DOWN = np.array([0.0, 0.0, -9.81])


@pytest.fixture(scope="module")
def robot():
    doggy = load_robot("doggy")
    source = replace(doggy.sensors["imu2"].source, field="linear_acceleration", unit="m/s^2")
    sensor = Accelerometer("acc", source, "imu2", 0.02, np.zeros(3), 0.5, gravity=DOWN)
    places = {name: Parameter(name, 0.0, "m", 0.0, 0.1, positive=False) for name in sensor.lever}
    return replace(doggy, sensors={**doggy.sensors, "acc": sensor}, parameters={**doggy.parameters, **places})


@pytest.fixture(scope="module")
def recording(robot):
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    truth = {"acc.lever_x": 0.1, "acc.lever_y": -0.03, "acc.lever_z": 0.08}
    return simulate(robot, "calibration", 2.0, seed=5, friction="smooth", parameters=truth).recording


def said(robot, recording, change=lambda values: values):
    stream = recording.streams["acc"]
    streams = {**recording.streams, "acc": replace(stream, values=change(stream.values))}
    notices = screen_all(replace(recording, streams=streams), robot)
    return [notice.text for notice in notices if notice.kind in PLAIN_MISTAKES]


def with_sensor(robot, name, **changes):
    return replace(robot, sensors={**robot.sensors, name: replace(robot.sensors[name], **changes)})


def test_a_right_accelerometer_passes_without_a_word(robot, recording):
    assert FELT_GRAVITY in PLAIN_MISTAKES
    assert said(robot, recording) == []
    assert said(robot, recording, lambda f: 1.02 * f + np.array([0.4, -0.3, 0.2])) == []


def test_a_right_one_in_fast_motion_passes_too(robot, recording):
    """Nine tenths of the time its readings are of another size than gravity: only the moments at rest are of its."""
    times = recording.streams["acc"].times
    fast = np.where((times > 0.1 * times[-1])[:, None], 6.0 * np.sin(150.0 * times)[:, None] * np.ones(3) * G, 0.0)
    size = np.median(np.linalg.norm(recording.streams["acc"].values + fast, axis=1))
    assert size > 2.0 * G
    assert said(robot, recording, lambda f: f + fast) == []


def test_minus_its_readings_are_said_to_be_minus(robot, recording):
    (text,) = said(robot, recording, lambda f: -f)
    assert "acc" in text and "reads minus what accelerometers do" in text


@pytest.mark.parametrize(("factor", "unit"), [(1.0 / G, "g")])
def test_its_unit_is_said(robot, recording, factor, unit):
    with pytest.raises(RecordingError, match=rf"look like {unit}: set `unit` of sensors.acc .* to {unit}"):
        said(robot, recording, lambda f: factor * f)


@pytest.mark.parametrize("gravity", [-DOWN, np.array([0.0, -9.81, 0.0]), np.array([9.81, 0.0, 0.0])])
def test_gravity_of_the_file_that_it_does_not_feel_is_said(robot, recording, gravity):
    (text,) = said(with_sensor(robot, "acc", gravity=gravity), recording)
    assert "write `gravity: [0, 0, -9.81]` in sensors.acc" in text


def test_axes_that_are_in_another_order_are_said(robot, recording):
    R = robot.sensors["imu2"].R_imu_body
    (text,) = said(robot, recording, lambda f: f[:, [1, 2, 0]])
    rows = ", ".join("[" + ", ".join(f"{x:.4g}" for x in row + 0.0) + "]" for row in R.round(6)[[1, 2, 0]])
    assert f"R_imu_body of sensors.imu2 is nearest to [{rows}]" in text and "left_handed" not in text
