# SPDX-License-Identifier: BSD-3-Clause
"""Torque sensors of a simulated Doggy with one plain mistake in them: named, with what to write; right ones are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.screening.mistaken_torque_sensors import MISTAKEN_TORQUE
from jointscope.graphs.screening.screen_all import PLAIN_MISTAKES, screen_all
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.sensors import TorqueSensor


@pytest.fixture(scope="module")
def robot():
    doggy = load_robot("doggy")
    source = replace(doggy.motor_encoder.source, topic="/torques", field="effort", unit="N m")
    return replace(doggy, sensors={**doggy.sensors, "torque": TorqueSensor("torque", source, 0.05, doggy.joints)})


@pytest.fixture(scope="module")
def recording(robot):
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    return simulate(robot, "calibration", 3.0, seed=4).recording


def said(robot, recording, name="torque", **changes):
    streams = {**recording.streams, name: replace(recording.streams[name], **changes)}
    notices = screen_all(replace(recording, streams=streams), robot)
    return [notice.text for notice in notices if notice.kind in PLAIN_MISTAKES]


def test_right_ones_pass_without_a_word(robot, recording):
    torque = recording.streams["torque"].values
    assert MISTAKEN_TORQUE in PLAIN_MISTAKES
    assert said(robot, recording) == []
    assert said(robot, recording, values=torque * np.array([1.1, 0.9, 1.0]) + np.array([2.0, 0.0, -0.5])) == []


@pytest.mark.parametrize("signs", [(-1, -1, -1), (1, -1, 1)])
def test_signs_are_said_with_the_scale_to_write(robot, recording, signs):
    (text,) = said(robot, recording, values=recording.streams["torque"].values * np.array(signs))
    assert "counts the other way than its drive" in text
    assert f"`scale: [{', '.join(map(str, signs))}]` in sensors.torque" in text


def test_a_command_that_counts_the_other_way_is_not_the_sensors_mistake(robot, recording):
    assert not any("torque" in text for text in said(robot, recording, "command", values=-recording.command.values))


@pytest.mark.parametrize(("factor", "unit", "scale"), [(1000.0, "N mm", "0.001"), (0.001, "kN m", "1000")])
def test_another_unit_is_said(robot, recording, factor, unit, scale):
    (text,) = said(robot, recording, values=factor * recording.streams["torque"].values)
    assert f"looks like {unit}" in text and f"`scale: [{scale}, {scale}, {scale}]`" in text


@pytest.mark.parametrize("order", [[1, 0, 2], [1, 2, 0]])
def test_exchanged_channels_are_said_with_their_names(robot, recording, order):
    (text,) = said(robot, recording, values=recording.streams["torque"].values[:, order])
    names = np.array(robot.torque_sensor.source.names)
    assert f"`names: [{', '.join(names[np.argsort(order)])}]` in sensors.torque" in text


@pytest.fixture(scope="module")
def light(robot):
    """A Doggy with light rotors that nothing disturbs: heavy ones take nearly all torque, which hides some ms."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate
    from jointscope.tools.simulator.world.disturbance import Disturbance

    truth = {"motor.inertia": 0.3, "motor.k_mi": 3.0}
    still = Disturbance()
    return simulate(robot, "calibration", 3.0, 4, friction="smooth", disturbance=still, parameters=truth).recording


@pytest.mark.parametrize("late", [0.010, -0.012])
def test_a_sensor_out_of_time_is_said(robot, light, late):
    assert said(robot, light) == []
    (text,) = said(robot, light, times=light.streams["torque"].times + late)
    assert f" ms {'late' if late > 0.0 else 'early'} against positions and commands" in text
    assert float(text.split("about ")[1].split(" ms")[0]) == pytest.approx(abs(1e3 * late), abs=2.0)


def test_a_command_that_is_late_is_not_the_sensors_mistake(robot, light):
    assert not any("torque" in t for t in said(robot, light, "command", times=light.command.times + 0.01))
