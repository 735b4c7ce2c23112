# SPDX-License-Identifier: BSD-3-Clause
"""Estimated states with +-3 sigma: now and at the lag, and how the sigmas go over the whole recording."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.replay.corrections import corrections
from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult
from jointscope.robots.parts.state_layout import StateLayout
from jointscope.tools.presentation.numbers import prefixed, with_sigma
from jointscope.tools.presentation.sensor_signals import COLOURS, liveliest
from jointscope.tools.presentation.settled import settled_reach
from jointscope.tools.report.page.page import Key, Section, figure
from jointscope.tools.report.page.panels import below_each_other, in_band
from jointscope.tools.report.page.plot import Axes, Band, Curve, Mark, plot

Array = NDArray[np.float64]
Limits = tuple[float, float]


def replay_states(result: ReplayResult) -> Section:
    """A closer look at deflection and velocities, then every sigma, biases and adapted parameters."""
    joints, layout = result.robot.joints, result.robot.layout
    keys = [Key(joint, COLOURS[i % 6]) for i, joint in enumerate(joints)]
    t = result.states.times
    whole = (float(t[0]), float(t[-1]))
    closer = liveliest(t, result.states.mean[:, layout.motor_v])
    band = [*keys, Key("±3 sigma", "soft", "band")]
    lead = (
        "What the controller gets: the newest state, from samples up to now only. Its error is not known, but what "
        f"{result.lag:g} s more of measurements change about it is, and should stay within ±3 sigma."
    )
    body = (
        "<h3>A closer look</h3>"
        + figure(_closer(result, layout, closer), band, group="replay closer")
        + "<h3>Newest state minus the smoothed one, with the ±3 sigma of the newest</h3>"
        + figure(_corrections(result, closer), band, group="replay closer")
        + "<h3>Sigma over the whole recording</h3>"
        + figure(_sigmas(result, layout, whole), keys, group="replay")
        + "<h3>Biases</h3>"
        + figure(_biases(result, whole), [Key(a, COLOURS[i]) for i, a in enumerate("xyz")], group="replay")
    )
    if result.states.parameters:
        body += "<h3>Adapted parameters</h3>" + figure(_parameters(result, whole), group="replay")
    return Section("states", "States and their sigmas", body, lead)


def _closer(result: ReplayResult, layout: StateLayout, limits: Limits) -> list[str]:
    now = result.states
    rows = [
        ("deflection", "rad", now.mean[:, layout.joint_q] - now.mean[:, layout.motor_q], now.deflection_sigma),
        ("link velocity", "rad/s", now.mean[:, layout.joint_v], now.sigma[:, layout.joint_v]),
        ("motor velocity", "rad/s", now.mean[:, layout.motor_v], now.sigma[:, layout.motor_v]),
    ]
    panels = []
    for title, unit, value, sigma in rows:
        seen = (now.times >= limits[0]) & (now.times <= limits[1])
        factor, unit = prefixed(float(np.max(np.abs(value[seen]), initial=0.0)), result.robot.unit(unit))
        marks: list[Mark] = []
        for i, joint in enumerate(result.robot.joints):
            marks += in_band(joint, now.times, factor * value[:, i], factor * sigma[:, i], COLOURS[i % 6])
        panels.append((Axes(f"{title} [{unit}]", height=190, x_range=limits), marks))
    return below_each_other(panels)


def _corrections(result: ReplayResult, limits: Limits) -> list[str]:
    """One panel per joint and quantity."""
    panels = []
    for found in corrections(result.robot, result.states, result.lagged):
        seen = (found.times >= limits[0]) & (found.times <= limits[1])
        t = found.times[seen]
        for i, joint in enumerate(result.robot.joints):
            y, s = found.difference[seen, i], 3.0 * found.sigma[seen, i]
            largest = max(np.max(np.abs(y), initial=0.0), np.max(s, initial=0.0))
            factor, unit = prefixed(float(largest), result.robot.unit_at(joint, found.unit))
            marks: list[Mark] = [
                Band("±3 sigma", t, -factor * s, factor * s, COLOURS[i % 6]),
                Curve(joint, t, factor * y, COLOURS[i % 6]),
            ]
            axes = Axes(f"{joint} {found.name} [{unit}]", "", height=92, x_range=limits)
            panels.append(plot(axes, marks))
    return panels


def _sigmas(result: ReplayResult, layout: StateLayout, limits: Limits) -> list[str]:
    s = result.states.sigma
    rows = [
        ("q_link", "rad", s[:, layout.joint_q]),
        ("v_link", "rad/s", s[:, layout.joint_v]),
        ("q_motor", "rad", s[:, layout.motor_q]),
        ("v_motor", "rad/s", s[:, layout.motor_v]),
        ("deflection", "rad", result.states.deflection_sigma),
    ]
    panels = []
    for title, unit, sigma in rows:
        factor, unit = prefixed(float(np.median(sigma)), result.robot.unit(unit))
        curves = [
            Curve(joint, result.states.times, factor * sigma[:, i], COLOURS[i % 6], points=500)
            for i, joint in enumerate(result.robot.joints)
        ]
        reach = (0.0, factor * settled_reach(result.states.times, sigma) or 1.0)
        panels.append((Axes(f"sigma of {title} [{unit}]", height=110, x_range=limits, y_range=reach), curves))
    return below_each_other(panels)


def _biases(result: ReplayResult, limits: Limits) -> list[str]:
    """Each axis against its last value, which the title tells."""
    panels, states = [], result.states
    for gyro, bias in states.biases.items():
        sigma = states.bias_sigmas[gyro]
        away = bias - bias[-1:]
        settled = np.abs(away[len(away) // 10 :])
        reach = 1.3 * max(float(np.max(settled, initial=0.0)), 3.0 * float(np.median(sigma)), 1e-9)
        own = result.robot.sensors[gyro].units[0]
        factor, unit = prefixed(reach, own)
        marks: list[Mark] = []
        for i, axis in enumerate("xyz"):
            marks += in_band(axis, states.times, factor * away[:, i], factor * sigma[:, i], COLOURS[i], 600)
        values = ", ".join(with_sigma(1e3 * b, 1e3 * s)[0] for b, s in zip(bias[-1], sigma[-1], strict=True))
        title = f"bias of {gyro} minus its last value [{unit}]; the last is ({values}) 1e-3 {own}"
        panels.append((Axes(title, height=150, x_range=limits, y_range=(-factor * reach, factor * reach)), marks))
    return below_each_other(panels)


def _parameters(result: ReplayResult, limits: Limits) -> list[str]:
    panels = []
    for name, rows in result.states.parameters.items():
        unit = result.robot.parameter(name).unit
        marks = in_band(name, result.states.times, rows[:, 0], rows[:, 1], "k2", 800)
        panels.append(plot(Axes(f"{name} [{unit}]", height=180, x_range=limits), marks))
    return panels
