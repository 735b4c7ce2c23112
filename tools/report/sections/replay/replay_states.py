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
    for k, (title, unit, value, sigma) in enumerate(rows):
        seen = (now.times >= limits[0]) & (now.times <= limits[1])
        factor, unit = prefixed(float(np.max(np.abs(value[seen]), initial=0.0)), result.robot.unit(unit))
        marks: list[Mark] = []
        for i, joint in enumerate(result.robot.joints):
            y, s = factor * value[:, i], 3.0 * factor * sigma[:, i]
            marks.append(Band("±3 sigma", now.times, y - s, y + s, COLOURS[i % 6]))
            marks.append(Curve(joint, now.times, y, COLOURS[i % 6]))
        last = k == len(rows) - 1
        axes = Axes(f"{title} [{unit}]", "time [s]" if last else "", height=190 + 28 * last, x_range=limits)
        panels.append(plot(axes, marks))
    return panels


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
    for k, (title, unit, sigma) in enumerate(rows):
        factor, unit = prefixed(float(np.median(sigma)), result.robot.unit(unit))
        curves = [
            Curve(joint, result.states.times, factor * sigma[:, i], COLOURS[i % 6], points=500)
            for i, joint in enumerate(result.robot.joints)
        ]
        last = k == len(rows) - 1
        top = factor * settled_reach(result.states.times, sigma)
        axes = Axes(
            f"sigma of {title} [{unit}]",
            "time [s]" if last else "",
            height=110 + 28 * last,
            x_range=limits,
            y_range=(0.0, top or 1.0),
        )
        panels.append(plot(axes, curves))
    return panels


def _biases(result: ReplayResult, limits: Limits) -> list[str]:
    """Each axis against its last value, which the title tells."""
    panels, states = [], result.states
    for k, (gyro, bias) in enumerate(states.biases.items()):
        sigma = states.bias_sigmas[gyro]
        away = bias - bias[-1:]
        settled = np.abs(away[len(away) // 10 :])
        reach = 1.3 * max(float(np.max(settled, initial=0.0)), 3.0 * float(np.median(sigma)), 1e-9)
        own = result.robot.sensors[gyro].units[0]
        factor, unit = prefixed(reach, own)
        marks: list[Mark] = []
        for i, axis in enumerate("xyz"):
            y, s = factor * away[:, i], 3.0 * factor * sigma[:, i]
            marks.append(Band("±3 sigma", states.times, y - s, y + s, COLOURS[i]))
            marks.append(Curve(axis, states.times, y, COLOURS[i], points=600))
        values = ", ".join(with_sigma(1e3 * b, 1e3 * s)[0] for b, s in zip(bias[-1], sigma[-1], strict=True))
        last = k == len(states.biases) - 1
        title = f"bias of {gyro} minus its last value [{unit}]; the last is ({values}) 1e-3 {own}"
        height, limits_y = 150 + 28 * last, (-factor * reach, factor * reach)
        axes = Axes(title, "time [s]" if last else "", height=height, x_range=limits, y_range=limits_y)
        panels.append(plot(axes, marks))
    return panels


def _parameters(result: ReplayResult, limits: Limits) -> list[str]:
    panels = []
    for name, rows in result.states.parameters.items():
        unit = result.robot.parameter(name).unit
        marks: list[Mark] = [
            Band("±3 sigma", result.states.times, rows[:, 0] - 3 * rows[:, 1], rows[:, 0] + 3 * rows[:, 1], "k2"),
            Curve(name, result.states.times, rows[:, 0], "k2", points=800),
        ]
        panels.append(plot(Axes(f"{name} [{unit}]", height=180, x_range=limits), marks))
    return panels
