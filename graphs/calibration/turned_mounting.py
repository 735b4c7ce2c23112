# SPDX-License-Identifier: BSD-3-Clause
"""Mountings that a calibration turned far from their priors without explaining their gyros by it.

A model that contradicts its recording pulls at everything that is free. A mounting that was turned by many sigmas of
its prior, and whose gyro is unexplained all the same, has not been found: it was bent, and from there no effect shows
as what it is. Such mountings are held at their priors, and the rest is calibrated anew.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.model.robot import Robot

FAR = 5.0  # [sigma of the prior]
UNEXPLAINED = 4.0  # mean squared residual, in sigmas, from which a gyro is not explained
TIGHT = 1e-4  # factor on the sigma of a prior that holds


def turned_without_reason(robot: Robot, result: CalibrationResult) -> dict[str, float]:
    """Angles [rad] by which mountings were turned from their priors for nothing, by gyro.

    Args:
        robot: before the calibration.
        result: the calibration.
    """
    found, calibrated = {}, {gyro.name: gyro.R_imu_body for gyro in result.robot.gyros}
    for gyro in robot.gyros:
        after = calibrated[gyro.name]
        angle = float(Rotation.from_matrix(after @ gyro.R_prior.T).magnitude())
        kept = [result.channels[channel].chi2 for channel in gyro.channels if channel in result.channels]
        left = max(kept, default=0.0)
        if angle > FAR * gyro.R_prior_sigma and left > UNEXPLAINED:
            found[gyro.name] = angle
    return found


def held(robot: Robot, names: dict[str, float]) -> Robot:
    """The robot with some mountings held at their priors."""
    return robot.with_sensors(
        {
            gyro.name: replace(gyro, R_imu_body=gyro.R_prior, R_prior_sigma=TIGHT * gyro.R_prior_sigma)
            for gyro in robot.gyros
            if gyro.name in names
        }
    )


def released(robot: Robot, result: CalibrationResult, names: dict[str, float]) -> CalibrationResult:
    """The result of a calibration with held mountings, their priors as they were, with what was done to them."""
    before = {gyro.name: gyro for gyro in robot.gyros}
    sensors = {
        gyro.name: replace(gyro, R_prior_sigma=before[gyro.name].R_prior_sigma)
        for gyro in result.robot.gyros
        if gyro.name in names
    }
    said = tuple(
        f"{name}: this calibration would turn the mounting by {np.degrees(angle):.0f} deg, "
        f"{angle / before[name].R_prior_sigma:.0f} sigma of its prior, and leave the gyro unexplained all the same; it "
        "was held: the model lacks something, or the axes of the gyro are not those of the robot file"
        for name, angle in names.items()
    )
    calibrated = result.robot.with_sensors(sensors)
    return replace(result, robot=calibrated, start=robot, findings=(*said, *result.findings))
