# SPDX-License-Identifier: BSD-3-Clause
"""How far a calibrated robot is from the truth, number by number.

The yaw of imu1 about its joint's axis (component z in the frame of the body) is left out everywhere: as long as the
bearing is rigid, that gyro sees rotation about this one axis only, and turning it about the axis changes nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
AXES = "xyz"
UNOBSERVABLE = "imu1.R_imu_body.z"


@dataclass(frozen=True)
class Deviation:
    """One calibrated number beside the true one.

    Attributes:
        name: full name; components carry their axis ("imu1.bias.x").
        kind: "dynamics", "bias" or "rotation".
        value, truth: in `unit`; a rotation is given by its error, so its truth is 0.
        sigma: claimed standard deviation; None where the robot claims none.
        unit: SI unit.
    """

    name: str
    kind: str
    value: float
    truth: float
    sigma: float | None
    unit: str

    @property
    def error(self) -> float:
        """Value minus truth."""
        return self.value - self.truth

    @property
    def percent(self) -> float:
        """Error in percent of the truth."""
        return 100.0 * self.error / self.truth

    @property
    def z(self) -> float:
        """Error in claimed standard deviations; NaN without a claim."""
        return self.error / self.sigma if self.sigma else float("nan")


def deviations(robot: Robot, truth: Mapping[str, Any]) -> list[Deviation]:
    """All parameters, biases and observable rotation components of a robot.

    Args:
        robot: a calibrated robot.
        truth: true values by full name; "imu1.bias" has three numbers, "imu1.R_imu_body" is a matrix.
    """
    found = [
        Deviation(p.name, "dynamics", p.value, float(truth[p.name]), p.sigma, p.unit) for p in robot.parameters.values()
    ]
    for gyro in robot.gyros:
        true_bias = np.asarray(truth[f"{gyro.name}.bias"], float)
        found += _components(f"{gyro.name}.bias", "bias", gyro.bias, true_bias, gyro.bias_sigma, "rad/s")
    for gyro in robot.gyros:
        turned = nearest_rotation(truth[f"{gyro.name}.R_imu_body"]).T @ gyro.R_imu_body
        error = Rotation.from_matrix(turned).as_rotvec()
        found += _components(f"{gyro.name}.R_imu_body", "rotation", error, np.zeros(3), gyro.R_sigma, "rad")
    return found


def nearest_rotation(matrix: Any) -> Array:
    """The rotation nearest to a matrix, shape (3, 3)."""
    U, _, Vt = np.linalg.svd(np.asarray(matrix, float))
    return U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt


def _components(name: str, kind: str, values: Array, truth: Array, sigmas: Array | None, unit: str) -> list[Deviation]:
    claimed = [None] * 3 if sigmas is None else [float(s) for s in sigmas]
    triples = zip(AXES, values, truth, claimed, strict=True)
    every = [Deviation(f"{name}.{axis}", kind, float(v), float(t), s, unit) for axis, v, t, s in triples]
    return [deviation for deviation in every if deviation.name != UNOBSERVABLE]
