# SPDX-License-Identifier: BSD-3-Clause
r"""Gravity as the readings of an accelerometer have it, told apart from its bias by the bias's prior.

    reading - what motion adds = -R_imu_base(k) g + bias,    bias ~ prior

Where the link does not tilt, a bias explains any gravity along the vertical, and its prior decides; where it tilts, the
readings do.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.bodies.body_accelerations import specific_force
from jointscope.robots.parts.sensors import Accelerometer
from jointscope.tools.presentation.numbers import significant

Array = NDArray[np.float64]

EARTH = 9.81  # [m/s^2]
ALIKE = 0.07  # share of it within which a vector is gravity: a bias of half a m/s^2, and the Earth is flattened
ALONG = 0.95  # cosine of the angle within which two vectors have one direction
SAMPLES = 300  # of each recording


def gravity_instead(result: CalibrationResult, sensor: Accelerometer) -> str:
    """What is likely wrong with the gravity or the unit of a sensor; empty where nothing known fits.

    Args:
        result: a calibration.
        sensor: of its robot.
    """
    stated = np.asarray(result.start.gravity_at(sensor), float)
    felt = felt_gravity(result, sensor)
    size, expected = float(np.linalg.norm(felt)), float(np.linalg.norm(stated))
    if abs(size - EARTH) < ALIKE * EARTH:
        along = float(felt @ stated) / max(size * expected, 1e-300)
        if abs(expected - EARTH) < ALIKE * EARTH and along > ALONG:
            return ""
        why = "of the wrong sign" if along < -ALONG else "in another unit" if along > ALONG else "along another axis"
        difference = significant(float(np.linalg.norm(felt - stated)) / EARTH, 2)
        return (
            f"most likely gravity is {why} in the robot file: {_vector(stated)} m/s^2 for {sensor.name}, "
            f"while its readings ask for {_vector(felt)}, {difference} g apart, which the bias takes"
        )
    for factor, unit in ((1.0 / EARTH, "g"), (EARTH, "m/s^2")):
        if abs(size - factor * EARTH) < ALIKE * factor * EARTH:
            return (
                f"most likely readings of {sensor.name} are in {unit}, not in the unit of the robot file: at rest they "
                f"would be {significant(size, 2)} m/s^2 instead of {EARTH}"
            )
    return ""


def felt_gravity(result: CalibrationResult, sensor: Accelerometer) -> Array:
    """Gravity in the base frame that explains the readings with a bias as its prior has it, shape (3,) [m/s^2].

    Args:
        result: a calibration.
        sensor: of its robot.
    """
    robot, start = result.robot, result.start
    gyro = next(gyro for gyro in robot.gyros if gyro.name == sensor.gyro)
    bags = [bag for bag in result.bags if sensor.name in bag.residuals]
    H, h = np.zeros((3 + 3 * len(bags),) * 2), np.zeros(3 + 3 * len(bags))
    before = next(s for s in start.accelerometers if s.name == sensor.name)
    for i, bag in enumerate(bags):
        series = bag.residuals[sensor.name]
        kept = np.unique(np.linspace(0, len(series.times) - 1, min(SAMPLES, len(series.times))).astype(int))
        kept = kept[np.all(np.isfinite(series.measured[kept] - series.predicted[kept]), axis=1)]
        ticks = np.clip(np.searchsorted(bag.ticks, series.times[kept]), 0, len(bag.ticks) - 1)
        q = bag.states[ticks][:, robot.layout.q_link]
        still, R = np.zeros_like(q), bag.calibration.rotations[gyro.name]
        axes = [
            specific_force(robot.kinematic_tree, gyro.body, np.zeros(3), q, still, still, axis).value @ R.T
            for axis in np.eye(3)
        ]
        A = np.stack(axes, axis=2)
        stated = A @ np.asarray(start.gravity_at(sensor), float)
        y = series.measured[kept] - series.predicted[kept] + stated + bag.calibration.biases[sensor.name]
        own = slice(3 + 3 * i, 6 + 3 * i)
        weight = len(kept) / sensor.sigma**2  # as good as the readings are, against the prior of the bias
        H[:3, :3] += weight * np.mean(A.transpose(0, 2, 1) @ A, axis=0)
        H[:3, own] = weight * np.mean(A, axis=0).T
        H[own, :3] = H[:3, own].T
        H[own, own] = weight * np.eye(3) + np.eye(3) / before.bias_prior_sigma**2
        h[:3] += weight * np.mean((A.transpose(0, 2, 1) @ y[:, :, None])[:, :, 0], axis=0)
        h[own] = weight * np.mean(y, axis=0) + before.bias / before.bias_prior_sigma**2
    return np.asarray(np.linalg.lstsq(H, h, rcond=None)[0][:3])


def _vector(v: Array) -> str:
    return f"[{', '.join(f'{element:.2f}' for element in np.round(v, 2) + 0.0)}]"
