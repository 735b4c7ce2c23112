# SPDX-License-Identifier: BSD-3-Clause
"""Readings at one state are those of the sensor factors, to rounding, with the errors of every effect."""

from __future__ import annotations

import numpy as np
import pytest
from robots_to_compare import READY, ROBOTS, states

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.base_model import with_full_gyros
from jointscope.graphs.problem.sensor_placement import factor_on_state
from jointscope.robots.model.readings_at_one_state import ReadingsAtOneState

COUNT = 6


@pytest.mark.parametrize("name", ROBOTS, ids=lambda name: name.replace(" ", "_"))
def test_readings_are_those_of_the_factors(name):
    robot = with_full_gyros(ROBOTS[name])
    readings, x = ReadingsAtOneState(robot), states(robot, COUNT)
    times, calibration = np.random.default_rng(3).uniform(1.0, 2.0, COUNT), Calibration.of(robot)
    for sensor, channels in ((s, s.channels) for s in robot.sensors.values()):
        factor = factor_on_state(robot, sensor.name, np.zeros((COUNT, len(channels))), times)
        found = factor.linearize((x,), calibration)
        bias = getattr(sensor, "bias", 0.0)
        for k in range(COUNT):
            reading, J = readings.read(sensor.name, x[k], times[k])
            np.testing.assert_allclose(reading + bias, found.residual[k], rtol=1e-11, atol=1e-12)
            np.testing.assert_allclose(J, found.by_state[0][k], rtol=1e-11, atol=1e-12)


def test_gyros_at_one_state_share_the_kinematics_and_do_not_mix_it_with_that_of_another():
    readings, x = ReadingsAtOneState(READY), states(READY, 2)
    alone = [ReadingsAtOneState(READY).read("imu2", x[k], 0.0)[0] for k in range(2)]
    for k in (0, 1, 0):
        readings.read("imu1", x[k], 0.0)
        np.testing.assert_array_equal(readings.read("imu2", x[k], 0.0)[0], alone[k])
