# SPDX-License-Identifier: BSD-3-Clause
"""The excitation as in Fig. 3 of the paper: commands above, measured motor angles below."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.calibration_result import BagFit, CalibrationResult
from jointscope.tools.presentation.sensor_signals import COLOURS, points_per_curve
from jointscope.tools.report.page.page import Key, Section, figure
from jointscope.tools.report.page.plot import Axes, Curve, plot
from jointscope.tools.report.sections.calibration.per_bag import per_bag

Array = NDArray[np.float64]

UNITS = {"1": "duty cycle", "V": "V", "A": "A", "N m": "N m"}


def commands(result: CalibrationResult) -> Section:
    """Commands and motor angles over the whole recording."""
    joints = result.robot.joints
    points = points_per_curve(result.bags)

    def draw(bag: BagFit, group: str) -> str:
        command = bag.recording.command
        unit = UNITS.get(command.unit, command.unit)
        panels = []
        above = [_curve(j, i, command.times, command.values[:, i], points) for i, j in enumerate(joints)]
        encoder = bag.residuals.get(result.robot.motor_encoder.name)
        axes = Axes(f"command [{unit}]", "" if encoder else "time [s]", x_range=_limits(bag))
        panels.append(plot(axes, above))
        if encoder:
            below = [_curve(j, i, encoder.times, encoder.measured[:, i], points) for i, j in enumerate(joints)]
            panels.append(
                plot(
                    Axes(f"measured motor position [{result.robot.unit('rad')}]", x_range=_limits(bag), height=200),
                    below,
                )
            )
        return figure(panels, [Key(j, COLOURS[i % 6]) for i, j in enumerate(joints)], group=group)

    lead = (
        "What the robot was asked to do. Slow motion shows friction, fast motion the motor, chirps springs and dampers."
    )
    return Section("commands", "Commands", per_bag(result, draw), lead)


def _limits(bag: BagFit) -> tuple[float, float]:
    return float(bag.ticks[0]), float(bag.ticks[-1])


def _curve(name: str, i: int, t: Array, y: Array, points: int) -> Curve:
    return Curve(name, t, y, COLOURS[i % 6], points=points)
