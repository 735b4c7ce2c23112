# SPDX-License-Identifier: BSD-3-Clause
"""Encoders on the links beside those on the motors, on a simulated Doggy."""

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.readings_at_one_state import ReadingsAtOneState
from jointscope.robots.parts.sensors import LinkEncoder


@pytest.fixture(scope="module")
def robot():
    """Doggy with encoders on its links, which do not read zero at zero, and no gyro."""
    doggy = load_robot("doggy")
    motors = doggy.motor_encoder
    links = LinkEncoder(
        "links", replace(motors.source, topic="/link_states"), np.full(3, 1e-4), np.full(3, 0.2), doggy.joints
    )
    return replace(doggy, sensors={motors.name: motors, "links": links})


@pytest.mark.slow
def test_springs_are_calibrated_from_the_two_encoders_of_each_joint_alone(robot):
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    made = simulate(robot, "calibration", 6.0, seed=5, friction="smooth")
    result = calibrate(robot, [made.recording])
    found = result.robot.parameters
    for joint in robot.joints:
        truth = made.truth["parameters"][f"{joint}.stiffness"]
        assert found[f"{joint}.stiffness"].value == pytest.approx(truth, rel=0.02)
    assert set(result.channels) == set(robot.channels)
    assert all(0.9 < result.channels[channel].chi2 < 1.2 for channel in robot.sensors["links"].channels)


def test_the_reading_at_one_state_is_the_angle_of_the_link(robot):
    x = np.random.default_rng(1).normal(size=robot.layout.size)
    reading, J = ReadingsAtOneState(robot).read("links", x, 0.0)
    np.testing.assert_allclose(reading, x[robot.layout.joint_q] + 0.2)
    np.testing.assert_allclose(J @ x, x[robot.layout.joint_q])
