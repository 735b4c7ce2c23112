# SPDX-License-Identifier: BSD-3-Clause
"""What follows from calibrated parameters, with sigmas from their covariance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.calibration_result import ParameterEstimate
from jointscope.robots.model.derived_values import derived_value
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]


def derived_results(robot: Robot, calibration: Calibration, covariance: Array) -> tuple[ParameterEstimate, ...]:
    """All derived results of a robot.

    Args:
        robot: before the calibration.
        calibration: the values that were found.
        covariance: of the shared values, whose first ones are the free parameters' coordinates, shape (s, s).
    """
    before = {name: p.value for name, p in robot.parameters.items()}
    now = before | dict(zip(calibration.names, calibration.values.tolist(), strict=True))
    count = len(calibration.names)
    scale = np.asarray(calibration.value_by_coordinate)
    of_values = covariance[:count, :count] * np.outer(scale, scale)
    found = []
    for result in robot.derived:
        value, slopes = derived_value(robot, result, now)
        by = np.array([slopes.get(name, 0.0) for name in calibration.names])
        sigma, start = float(np.sqrt(by @ of_values @ by)), derived_value(robot, result, before)[0]
        found.append(ParameterEstimate(result.name, value, sigma, result.unit, start, start, 0.0, derived=True))
    return tuple(found)
