# SPDX-License-Identifier: BSD-3-Clause
"""The estimated process noise of each equation, and when the dynamics do not hold."""

from __future__ import annotations

from html import escape

import numpy as np

from jointscope.graphs.calibration.calibration_result import BagFit, CalibrationResult
from jointscope.tools.presentation.judgement import equation_names
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.presentation.sensor_signals import COLOURS
from jointscope.tools.presentation.whiteness import strength
from jointscope.tools.report.page.page import Key, Section, figure, table
from jointscope.tools.report.page.plot import Axes, Curve, plot
from jointscope.tools.report.sections.calibration.per_bag import per_bag


def noise(result: CalibrationResult) -> Section:
    """Densities before and after, and the residual of the dynamics over time."""
    now = np.concatenate([result.noise.link_velocity, result.noise.motor_velocity])
    before = np.concatenate([result.start.noise.link_velocity, result.start.noise.motor_velocity])
    rows = [
        [escape(name), significant(b), f"<b>{significant(a)}</b>", significant(a / b, 2), significant(a * np.sqrt(0.1))]
        for name, a, b in zip(equation_names(result), now, before, strict=True)
    ]
    head = ["equation", "start [rad/s/√s]", "estimated [rad/s/√s]", "ratio", "velocity lost in 0.1 s [rad/s]"]

    def draw(bag: BagFit, group: str) -> str:
        edges, rms = strength(bag.ticks[:-1], bag.process / bag.process_sigma)
        t = 0.5 * (edges[1:] + edges[:-1])
        panels, layout = [], result.robot.layout
        for k, (side, rows) in enumerate((("link", layout.joint_link), ("motor", layout.motor_row))):
            curves = [Curve(joint, t, rms[:, rows[i]], COLOURS[i % 6]) for i, joint in enumerate(layout.joints)]
            title = f"residual of the {side} equations, rms over 0.25 s [sigma]"
            limits = (float(bag.ticks[0]), float(bag.ticks[-1]))
            label = "time [s]" if k else ""
            panels.append(plot(Axes(title, label, height=150 + 28 * k, x_range=limits, levels=[(1.0, "")]), curves))
        keys = [Key(joint, COLOURS[i % 6]) for i, joint in enumerate(result.robot.joints)]
        return figure(panels, keys, group=group)

    estimated = "estimated" if result.robot.noise.estimate else "given, not estimated,"
    lead = (
        f"How much the velocities wander beside the model ({estimated} as a random walk). Small and even is good; "
        "peaks show when the model misses something."
    )
    return Section("noise", "Process noise", table(head, rows, [1, 2, 3, 4]) + per_bag(result, draw), lead)
