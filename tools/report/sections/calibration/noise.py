# SPDX-License-Identifier: BSD-3-Clause
"""The estimated process noise of each equation, and when the dynamics do not hold."""

from __future__ import annotations

from html import escape

import numpy as np

from jointscope.graphs.calibration.calibration_result import BagFit, CalibrationResult
from jointscope.robots.model.lasting_torques import lasting_torques
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.presentation.sensor_signals import COLOURS
from jointscope.tools.report.page.page import Key, Section, figure, table
from jointscope.tools.report.page.panels import below_each_other
from jointscope.tools.report.page.plot import Axes, Curve
from jointscope.tools.report.sections.calibration.per_bag import per_bag
from jointscope.tools.verdicts.judgement import equation_names
from jointscope.tools.verdicts.whiteness import strength


def noise(result: CalibrationResult) -> Section:
    """Densities before and after, and the residual of the dynamics over time."""
    now, lost = np.concatenate([result.noise.link_velocity, result.noise.motor_velocity]), result.noise.drift(0.1)
    before = np.concatenate([result.start.noise.link_velocity, result.start.noise.motor_velocity])
    rows = [
        [escape(name), significant(b), f"<b>{significant(a)}</b>", significant(a / b, 2), significant(v)]
        for name, a, b, v in zip(equation_names(result), now, before, lost, strict=True)
    ]
    head = ["equation", "start [rad/s/√s]", "estimated [rad/s/√s]", "ratio", "velocity lost in 0.1 s [rad/s]"]
    torques = lasting_torques(result.robot)
    if torques:
        head.append("torque that lasts, rms [N m]")
        rows = [[*row, significant(size)] for row, size in zip(rows, torques.values(), strict=True)]

    def draw(bag: BagFit, group: str) -> str:
        edges, rms = strength(bag.ticks[:-1], bag.process / bag.process_sigma)
        t = 0.5 * (edges[1:] + edges[:-1])
        panels, layout = [], result.robot.layout
        for side, rows in (("link", layout.joint_link), ("motor", layout.motor_row)):
            curves = [Curve(joint, t, rms[:, rows[i]], COLOURS[i % 6]) for i, joint in enumerate(layout.joints)]
            title = f"residual of the {side} equations, rms over 0.25 s [sigma]"
            limits = (float(bag.ticks[0]), float(bag.ticks[-1]))
            panels.append((Axes(title, height=150, x_range=limits, levels=[(1.0, "")]), curves))
        keys = [Key(joint, COLOURS[i % 6]) for i, joint in enumerate(result.robot.joints)]
        return figure(below_each_other(panels), keys, group=group)

    estimated = "estimated" if result.robot.noise.estimate else "given, not estimated,"
    lead = (
        f"How much the velocities wander beside the model ({estimated} as a random walk). Small and even is good; "
        "peaks show when the model misses something."
    )
    if torques:
        memory = 1e3 * result.noise.correlation_time
        lead += f" Beside them torques come and go that no law explains, with a memory of {memory:g} ms."
    return Section("noise", "Process noise", table(head, rows, list(range(1, len(head)))) + per_bag(result, draw), lead)
