# SPDX-License-Identifier: BSD-3-Clause
"""How the gyroscopes sit on their bodies, and their biases."""

from __future__ import annotations

import math
from html import escape

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult, ParameterEstimate
from jointscope.robots.parts.sensors import Gyro
from jointscope.tools.presentation.numbers import minus, with_sigma
from jointscope.tools.report.page.page import Section, foldable, table
from jointscope.tools.verdicts.priors.held_values import is_held


def mounting(result: CalibrationResult) -> Section:
    """Angles of each gyro about its body's axes, biases, and the rotation matrices."""
    angles = [_row(p, 180.0 / math.pi, "deg") for p in result.parameters if ".R_imu_body" in p.name]
    biases = [_row(p, 1.0, p.unit) for p in result.parameters if ".bias" in p.name]
    first = result.bags[0].recording.path if len(result.bags) > 1 else ""
    head = ["angle away from the prior, or bias", "value", "± sigma", "unit", "note"]
    body = table(head, [*angles, *biases], [1, 2]) if angles or biases else ""
    body += f'<p class="quiet">Biases are those of {escape(first)}.</p>' if first else ""
    matrices = "".join(_matrix(gyro) for gyro in result.robot.gyros)
    body += foldable("rotation matrices R_imu_body", f'<div class="figures">{matrices}</div>') if matrices else ""
    lead = (
        "Angles about the axes of the body that carries the sensor, measured from the mounting that the prior states."
    )
    return Section("mounting", "Gyro mounting and biases", body, lead)


def _row(p: ParameterEstimate, factor: float, unit: str) -> list[str]:
    value, sigma = with_sigma(factor * p.value, factor * p.sigma)
    text = p.note or ("held by its prior" if is_held(p) else "")
    note = f'<span class="tag info">{escape(text)}</span>' if text else ""
    return [f"<code>{escape(p.name)}</code>", f"<b>{value}</b>", sigma, escape(unit), note]


def _matrix(gyro: Gyro) -> str:
    rows = "<br>".join("&nbsp; ".join(minus(f"{x:+.4f}") for x in row) for row in gyro.R_imu_body)
    away = np.linalg.norm(_rotation_vector(gyro.R_prior.T @ gyro.R_imu_body))
    angle = f"{math.degrees(float(away)):.2f} deg from the prior"
    return f"<div><span>{escape(gyro.name)} on {escape(gyro.body)}, {angle}</span><code>{rows}</code></div>"


def _rotation_vector(R: np.ndarray) -> np.ndarray:
    angle = math.acos(min(max((np.trace(R) - 1.0) / 2.0, -1.0), 1.0))
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    length = float(np.linalg.norm(axis))
    return axis * (angle / length) if length > 1e-12 else np.array([angle, 0.0, 0.0])
