# SPDX-License-Identifier: BSD-3-Clause
"""Which combinations of parameters a recording determines badly, in names and percentages.

Dynamic parameters: eigenvectors of their covariance in relative changes. Rotations and biases: directions whose
standard deviation stays near that of the prior; a rotation is looked at as a whole, so that the axis can be named.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration, bias_block, rotation_block
from jointscope.graphs.calibration.calibration_result import WeakDirection
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.relative_sigma import relative_sigma
from jointscope.robots.parts.sensors import AXES

Array = NDArray[np.float64]

WEAK_RELATIVE = 0.02  # relative standard deviation from which a combination of parameters is called weak
WEAK_OF_PRIOR = 0.3  # share of the prior's standard deviation from which a direction is called held by its prior
MEMBER = 0.25  # weight, relative to the largest, from which a parameter belongs to a direction


def weak_directions(
    robot: Robot, calibration: Calibration, shared: SharedLayout, covariance: Array
) -> tuple[WeakDirection, ...]:
    """All badly determined directions, dynamic parameters first, worst first.

    Args:
        robot: gives priors.
        calibration: gives names.
        shared: layout of the shared values.
        covariance: of the shared values, shape (s, s).
    """
    columns = shared.columns[DYNAMICS]
    size = _sizes(calibration)
    found = _weak_dynamics(calibration, covariance[columns, columns] / np.outer(size, size))
    for gyro in robot.gyros:
        columns = shared.columns[rotation_block(gyro.name)]
        names = [f"{gyro.name}.R_imu_body.{axis}" for axis in AXES]
        found += _weak_block(names, covariance[columns, columns], gyro.R_prior_sigma, gyro.body, "rad")
    for sensor in robot.biased:
        columns = shared.columns[bias_block(sensor.name)]
        names = [f"{sensor.name}.bias.{axis}" for axis in AXES]
        found += _weak_block(names, covariance[columns, columns], sensor.bias_prior_sigma, "", sensor.units[0])
    return tuple(found)


def _sizes(calibration: Calibration) -> Array:
    """What the standard deviations are relative to, shape (p,): one for logarithms, and for small values.

    Parameters of any sign are estimated in their unit; a large one is determined well if it is so for its size.
    """
    return np.where(calibration.positive, 1.0, np.maximum(np.abs(calibration.values), 1.0))


def _weak_dynamics(calibration: Calibration, covariance: Array) -> list[WeakDirection]:
    """Eigenvectors of the relative covariance above the threshold."""
    values, vectors = np.linalg.eigh(covariance)
    found = []
    for variance, vector in sorted(zip(values, vectors.T, strict=True), key=lambda pair: -pair[0]):
        sigma = float(np.sqrt(max(variance, 0.0)))
        lead = int(np.argmax(np.abs(vector)))
        relative = sigma * abs(float(vector[lead]))
        if relative < WEAK_RELATIVE:
            continue
        weights = _weights(calibration.names, vector * np.sign(vector[lead]))
        found.append(WeakDirection(weights, relative, _dynamics_sentence(weights, relative)))
    return found


def _weak_block(names: Sequence[str], covariance: Array, prior: float, body: str, unit: str) -> list[WeakDirection]:
    """Directions of a rotation or bias that keep a good part of their prior's uncertainty."""
    values, vectors = np.linalg.eigh(covariance)
    found = []
    for variance, vector in zip(values, vectors.T, strict=True):
        sigma = float(np.sqrt(max(variance, 0.0)))
        if sigma < WEAK_OF_PRIOR * prior:
            continue
        weights = _weights(names, vector * np.sign(vector[np.argmax(np.abs(vector))]))
        spread = f"{np.degrees(sigma):.2g} deg" if unit == "rad" else f"{sigma:.2g} rad/s"
        share = sigma / prior
        if unit == "rad":
            axis = ", ".join(f"{w:+.2f} {n[-1]}" for n, w in weights.items())
            what = f"the rotation {names[0].rsplit('.', 1)[0]} about the axis ({axis}) of {body}"
        else:
            what = " and ".join(weights)
        seen = "is not observable in this recording" if share > 0.9 else "is hardly observable in this recording"
        found.append(WeakDirection(weights, sigma, f"{what} {seen}; its prior holds it, +-{spread}"))
    return found


def _weights(names: Sequence[str], vector: Array) -> dict[str, float]:
    """Members of a direction, largest first."""
    order = np.argsort(-np.abs(vector))
    largest = abs(vector[order[0]])
    return {names[i]: float(vector[i]) for i in order if abs(vector[i]) >= MEMBER * largest}


def _dynamics_sentence(weights: dict[str, float], relative: float) -> str:
    spread = relative_sigma(relative)
    names = list(weights)
    if len(names) == 1:
        return f"{names[0]} is weakly determined, {spread}"
    listed = ", ".join(names[:-1]) + " and " + names[-1]
    together = all(w > 0 for w in weights.values())
    return f"{listed} {'scale together' if together else 'trade off against each other'}, {spread}"
