# SPDX-License-Identifier: BSD-3-Clause
"""Springs and friction as rests show them: each curve with its band, and the measured points on it."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.rest_sets.rest_curves import MeasuredCurve, friction_curves, spring_curves
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.tools.report.page.page import Key, Section, figure
from jointscope.tools.report.page.plot import Axes, Band, Curve, Mark, plot

SIGMAS = 2.0  # half width of the bands that are drawn


def rest_pictures(problems: list[RestSet], covariance: np.ndarray) -> list[Section]:
    """Fig. 4 and Fig. 5 of the BioRob paper for any robot; nothing without rests.

    Args:
        problems: rests of the calibrated robot.
        covariance: of the values of its free parameters, shape (p, p).
    """
    if not problems:
        return []
    springs, friction = spring_curves(problems, covariance), friction_curves(problems, covariance)
    found = []
    if springs:
        lead = (
            "Torque of each spring on its motor over its deflection, with the band of two sigmas. Points: deflection "
            "of the encoders at each rest, torque of gravity and known loads."
        )
        panels = [_picture(c, f"{c.joint}: spring torque [N m]", "deflection [rad]") for c in springs]
        found.append(Section("springs", "Springs", figure(panels, _keys()), lead))
    if friction:
        lead = (
            "Dry friction that a motor can hold over the size of its load, with the band of two sigmas. Points: what "
            "friction held at each rest before which the motor had moved; they lie below the curve, the closer to it "
            "the nearer the motor was to slipping."
        )
        panels = [_picture(c, f"{c.joint}: friction [N m]", "load [N m]") for c in friction]
        found.append(Section("friction", "Friction at rest", figure(panels, _keys()), lead))
    return found


def rests_of(result: CalibrationResult) -> tuple[list[RestSet], np.ndarray]:
    """The rests beside the motion of a calibration, with its robot, and the covariance of the robot's values."""
    problems = [problem.of_robot(result.robot) for problem, *_ in result.sets if isinstance(problem, RestSet)]
    free = [p for p in result.parameters if p.name in result.robot.parameters]
    sigmas, n = np.array([p.sigma for p in free]), len(free)
    return problems, result.correlation[:n, :n] * np.outer(sigmas, sigmas)


def _picture(curve: MeasuredCurve, title: str, label: str) -> str:
    low, high = curve.y - SIGMAS * curve.sigma, curve.y + SIGMAS * curve.sigma
    marks: list[Mark] = [
        Band("two sigmas", curve.x, low, high, "k1"),
        Curve("model", curve.x, curve.y, "k1"),
        Curve("measured", curve.points_x, curve.points_y, "k0", "dots"),
    ]
    return plot(Axes(title, label, height=240), marks)


def _keys() -> list[Key]:
    return [Key("measured", "k0", "dots"), Key("model", "k1"), Key("two sigmas", "k1", "band")]
