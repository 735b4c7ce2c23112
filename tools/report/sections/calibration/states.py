# SPDX-License-Identifier: BSD-3-Clause
"""The smoothed states with their sigma bands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointscope.graphs.calibration.calibration_result import BagFit, CalibrationResult
from jointscope.robots.model.robot import Robot
from jointscope.tools.presentation.numbers import prefixed
from jointscope.tools.presentation.sensor_signals import COLOURS, liveliest, points_per_curve
from jointscope.tools.report.page.page import Key, Section, figure
from jointscope.tools.report.page.panels import below_each_other, in_band
from jointscope.tools.report.page.plot import Axes, Curve, Mark
from jointscope.tools.report.sections.calibration.per_bag import per_bag

Limits = tuple[float, float]


def states(result: CalibrationResult) -> Section:
    """Deflection and link velocity with bands, then every sigma over the whole recording."""
    joints = result.robot.joints
    keys = [Key(joint, COLOURS[i % 6]) for i, joint in enumerate(joints)]
    band = [*keys, Key("±3 sigma", "soft", "band")]
    points = points_per_curve(result.bags)

    def draw(whole_bag: BagFit, group: str) -> str:
        layout = result.robot.layout
        bag = replace(whole_bag, states=layout.by_joint(whole_bag.states), sigmas=layout.by_joint(whole_bag.sigmas))
        whole = (float(bag.ticks[0]), float(bag.ticks[-1]))
        closer = liveliest(bag.ticks, bag.states[:, 3 * len(joints) :])
        return (
            "<h3>A closer look</h3>"
            + figure(_with_bands(bag, result.robot, closer, points), band, group=f"{group} closer")
            + "<h3>Sigma over the whole recording</h3>"
            + figure(_sigmas(bag, result.robot, whole), keys, group=group)
        )

    seen = result.robot.link_encoder is not None
    how = ("No encoder sees", "infers them from"), ("Encoders see", "weighs them against")
    lead = (
        f"{how[seen][0]} the links; the smoother {how[seen][1]} the dynamics. The deflection q_link − q_motor is what "
        "the springs feel."
    )
    return Section("states", "States and their sigmas", per_bag(result, draw), lead)


def _with_bands(bag: BagFit, robot: Robot, limits: Limits, points: int) -> list[str]:
    joints, n = robot.joints, robot.n
    q_link, v_link, q_motor = (bag.states[:, k * n : (k + 1) * n] for k in range(3))
    deflection = q_link - q_motor
    factor, unit = prefixed(float(np.max(np.abs(deflection), initial=0.0)), robot.unit("rad"))
    rows = (
        (f"deflection [{unit}]", factor * deflection, factor * bag.sigmas[:, :n]),
        (f"link velocity [{robot.unit('rad/s')}]", v_link, bag.sigmas[:, n : 2 * n]),
    )
    panels = []
    for title, values, sigmas in rows:
        marks: list[Mark] = []
        for i, joint in enumerate(joints):
            marks += in_band(joint, bag.ticks, values[:, i], sigmas[:, i], COLOURS[i % 6], points)
        panels.append((Axes(title, height=190, x_range=limits), marks))
    return below_each_other(panels)


def _sigmas(bag: BagFit, robot: Robot, limits: Limits) -> list[str]:
    joints, n = robot.joints, robot.n
    panels = []
    names = (("q_link", "rad"), ("v_link", "rad/s"), ("q_motor", "rad"), ("v_motor", "rad/s"))
    for k, (title, unit) in enumerate(names):
        sigma = bag.sigmas[:, k * n : (k + 1) * n]
        factor, prefix_unit = prefixed(float(np.median(sigma)), robot.unit(unit))
        curves = [
            Curve(joint, bag.ticks, factor * sigma[:, i], COLOURS[i % 6], points=500) for i, joint in enumerate(joints)
        ]
        reach = (0.0, 1.3 * factor * float(np.quantile(sigma, 0.995)))
        panels.append((Axes(f"sigma of {title} [{prefix_unit}]", height=110, x_range=limits, y_range=reach), curves))
    return below_each_other(panels)
