# SPDX-License-Identifier: BSD-3-Clause
"""A mounting that a contradicting model bends is held; one that the recording tells is kept."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jointscope.graphs.calibration.turned_mounting import held, released, turned_without_reason


def result(doggy, angle, chi2):
    """A calibration that turned the first gyro's mounting and left so much of it."""
    gyro = doggy.gyros[0]
    turned = replace(gyro, R_imu_body=Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix() @ gyro.R_prior)
    channels = {channel: SimpleNamespace(chi2=chi2) for channel in gyro.channels}
    channels |= {channel: SimpleNamespace(chi2=1.0) for channel in doggy.gyros[1].channels}
    return SimpleNamespace(robot=doggy.with_sensors({gyro.name: turned}), channels=channels)


def test_only_what_was_turned_far_and_is_unexplained_is_without_reason(doggy):
    name, sigma = doggy.gyros[0].name, doggy.gyros[0].R_prior_sigma
    assert turned_without_reason(doggy, result(doggy, 10.0 * sigma, 400.0)) == {name: pytest.approx(10.0 * sigma)}
    assert turned_without_reason(doggy, result(doggy, 10.0 * sigma, 1.1)) == {}
    assert turned_without_reason(doggy, result(doggy, 2.0 * sigma, 400.0)) == {}


@pytest.fixture(scope="module")
def recording(doggy):
    """Three seconds of a Doggy whose first gyro is mounted 0.8 rad beside what its file says."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    return simulate(doggy, "calibration", 3.0, seed=5, friction="smooth").recording


def near(doggy):
    return doggy.with_values({name: p.published for name, p in doggy.parameters.items() if p.published is not None})


@pytest.mark.slow
def test_a_wrong_mounting_in_the_file_that_explains_its_gyro_is_found_and_kept(doggy, recording):
    from jointscope.graphs.calibration.calibrate import calibrate

    turn = Rotation.from_rotvec([0.8, 0.0, 0.0]).as_matrix()
    gyro = doggy.gyros[1]
    wrong = near(doggy).with_sensors(
        {gyro.name: replace(gyro, R_imu_body=turn @ gyro.R_prior, R_prior=turn @ gyro.R_prior)}
    )
    found = calibrate(wrong, [recording])
    back = Rotation.from_matrix(found.robot.sensors[gyro.name].R_imu_body @ gyro.R_prior.T).magnitude()
    assert back < 0.2 and not any("was held" in text for text in found.findings)


@pytest.mark.slow
def test_a_held_mounting_stays_and_its_prior_comes_back(doggy, recording):
    from jointscope.graphs.calibration.calibrate import calibrate

    gyro = doggy.gyros[0]
    names = {gyro.name: 1.2}
    robot = near(doggy)
    anew = calibrate(held(robot, names), [recording])
    again = released(robot, anew, names)
    after = again.robot.sensors[gyro.name]
    assert Rotation.from_matrix(after.R_imu_body @ gyro.R_prior.T).magnitude() < 1e-3
    assert after.R_prior_sigma == gyro.R_prior_sigma and np.all(again.start.gyros[0].R_imu_body == gyro.R_imu_body)
    assert f"{gyro.name}: this calibration would turn the mounting by 69 deg, 12 sigma" in again.findings[0]
