# SPDX-License-Identifier: BSD-3-Clause
"""Estimated states over time with +-3 sigma: now, and at the lag; their sigmas; biases; adapted parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.replay.corrections import corrections
from jointscope.graphs.fixed_lag.replay.replay_result import StateSeries
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.state_layout import StateLayout
from jointscope.tools.presentation.settled import settled_reach
from jointscope.tools.rerun_log.entities.columns import GREY, JOINT_COLOURS, send_band, send_lines
from jointscope.tools.rerun_log.entities.tab_contents import plot_columns, plot_view
from jointscope.tools.rerun_log.entities.viewer_text import entity

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

Array = NDArray[np.float64]

QUANTITIES = (("position", "rad"), ("deflection", "rad"), ("v_link", "rad/s"), ("v_motor", "rad/s"))
SIGMAS = (("q_link", "rad"), ("v_link", "rad/s"), ("q_motor", "rad"), ("v_motor", "rad/s"), ("deflection", "rad"))


def send_estimate_lines(stream: rr.RecordingStream, robot: Robot, states: StateSeries, lagged: StateSeries) -> None:
    """Entities states/JOINT/QUANTITY/(now|band|lagged), sigma/QUANTITY, bias/GYRO and parameters/NAME."""
    layout = robot.layout
    now, smoothed = _quantities(layout, states), _quantities(layout, lagged)
    for i, joint in enumerate(robot.joints):
        colour = JOINT_COLOURS[i % 6]
        for name, (value, sigma) in now.items():
            path = entity("states", joint, name)
            send_lines(stream, f"{path}/now", states.times, value[:, i : i + 1], [f"{name} now"], [colour])
            send_band(stream, f"{path}/band", states.times, value[:, i : i + 1], 3.0 * sigma[:, i : i + 1], [colour])
            at_lag = smoothed[name][0][:, i : i + 1]
            send_lines(stream, f"{path}/lagged", lagged.times, at_lag, [f"{name} at the lag"], [GREY], 1.0)
    _send_sigmas(stream, robot, states)
    for gyro, bias in states.biases.items():
        path, colours = entity("bias", gyro), JOINT_COLOURS[:3]
        send_lines(stream, f"{path}/value", states.times, bias, [f"{gyro}.bias.{a}" for a in "xyz"], colours)
        send_band(stream, f"{path}/band", states.times, bias, 3.0 * states.bias_sigmas[gyro], colours)
    for i, (name, rows) in enumerate(states.parameters.items()):
        path, own = entity("parameters", name), [JOINT_COLOURS[i % 6]]
        send_lines(stream, f"{path}/value", states.times, rows[:, :1], [name], own)
        send_band(stream, f"{path}/band", states.times, rows[:, :1], 3.0 * rows[:, 1:], own)


def send_corrections(stream: rr.RecordingStream, robot: Robot, states: StateSeries, lagged: StateSeries) -> None:
    """Entities corrections/JOINT/QUANTITY: newest minus smoothed state, with the +-3 sigma of the newest."""
    for c in corrections(robot, states, lagged):
        for i, joint in enumerate(robot.joints):
            path, colour, at = entity("corrections", joint, c.name), [JOINT_COLOURS[i % 6]], slice(i, i + 1)
            send_lines(stream, f"{path}/newest_minus_smoothed", c.times, c.difference[:, at], [c.name], colour)
            send_band(stream, f"{path}/band", c.times, 0.0 * c.sigma[:, at], 3.0 * c.sigma[:, at], [GREY])


def correction_views(robot: Robot, states: StateSeries, lagged: StateSeries) -> rrb.Horizontal:
    """One column per joint, one row per quantity."""

    def view(joint: str, i: int, name: str, unit: str, sigma: Array) -> rrb.TimeSeriesView:
        top = 4.5 * float(np.median(sigma[:, i])) if len(sigma) else 0.0
        title, reach = f"{joint} {name}, newest - smoothed [{unit}]", (-top, top) if top > 0.0 else None
        return plot_view(title, "corrections", joint, name, legend=False, reach=reach)

    rows = corrections(robot, states, lagged)
    columns = [
        [view(joint, i, c.name, robot.unit_at(joint, c.unit), c.sigma) for c in rows]
        for i, joint in enumerate(robot.joints)
    ]
    return plot_columns(columns, "newest - smoothed")


def estimate_views(robot: Robot) -> rrb.Horizontal:
    """One column per joint, one row per quantity."""
    import rerun.blueprint as rrb

    return rrb.Horizontal(*(joint_views(robot, joint) for joint in robot.joints), name="states")


def joint_views(robot: Robot, joint: str) -> rrb.Vertical:
    """The states of one joint."""
    import rerun.blueprint as rrb

    titles = {name: f"{joint} {name} [{robot.unit_at(joint, unit)}]" for name, unit in QUANTITIES}
    return rrb.Vertical(*(plot_view(title, "states", joint, name, legend=False) for name, title in titles.items()))


def sigma_views(robot: Robot, states: StateSeries | None = None) -> rrb.Vertical:
    """One plot per quantity; known states say how far each axis must reach, as the first sigmas are far larger."""
    import rerun.blueprint as rrb

    views = []
    for name, unit in SIGMAS:
        known = states if states is not None and len(states.times) else None
        top = 0.0 if known is None else settled_reach(known.times, _sigmas(robot, known)[name])
        reach = (0.0, top) if top > 0.0 else None
        views.append(plot_view(f"sigma of {name} [{robot.unit(unit)}]", "sigma", name, reach=reach))
    return rrb.Vertical(*views, name="sigmas")


def bias_views(robot: Robot, adapted: tuple[str, ...]) -> rrb.Vertical:
    """One plot per gyro, accelerometer and adapted parameter."""
    import rerun.blueprint as rrb

    views = [plot_view(f"bias of {s.name} [{s.units[0]}]", "bias", s.name) for s in robot.biased]
    views += [plot_view(f"{name} [{robot.parameter(name).unit}]", "parameters", name) for name in adapted]
    return rrb.Vertical(*views, name="biases and parameters" if adapted else "biases")


def _quantities(layout: StateLayout, series: StateSeries) -> dict[str, tuple[Array, Array]]:
    """Value and sigma of each quantity of the joints, shapes (m, n)."""
    x, s = series.mean, series.sigma
    link, motor = layout.joint_q, layout.motor_q
    return {
        "position": (x[:, link], s[:, link]),
        "deflection": (x[:, link] - x[:, motor], series.deflection_sigma),
        "v_link": (x[:, layout.joint_v], s[:, layout.joint_v]),
        "v_motor": (x[:, layout.motor_v], s[:, layout.motor_v]),
    }


def _sigmas(robot: Robot, states: StateSeries) -> dict[str, Array]:
    """Sigmas of the joints by quantity, shapes (m, n)."""
    layout, s = robot.layout, states.sigma
    return {
        "q_link": s[:, layout.joint_q],
        "v_link": s[:, layout.joint_v],
        "q_motor": s[:, layout.motor_q],
        "v_motor": s[:, layout.motor_v],
        "deflection": states.deflection_sigma,
    }


def _send_sigmas(stream: rr.RecordingStream, robot: Robot, states: StateSeries) -> None:
    """Sigmas of all joints in one plot per quantity."""
    colours = [JOINT_COLOURS[i % 6] for i in range(robot.n)]
    for name, values in _sigmas(robot, states).items():
        send_lines(stream, entity("sigma", name), states.times, values, robot.joints, colours)
