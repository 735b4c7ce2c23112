# SPDX-License-Identifier: BSD-3-Clause
"""A calibration as an .rrd file: residuals, states with sigma, covariance, robot in 3D, findings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from jointscope.graphs.calibration.calibration_result import BagFit, CalibrationResult
from jointscope.robots.model.robot import Robot
from jointscope.tools.presentation.sensor_signals import bag_name
from jointscope.tools.rerun_log.entities.columns import GREY, JOINT_COLOURS, WHITE, send_band, send_lines
from jointscope.tools.rerun_log.entities.covariance_picture import covariance_views, send_covariance
from jointscope.tools.rerun_log.entities.moving_robot import robot_view, send_robot
from jointscope.tools.rerun_log.entities.rrd_file import rrd_file
from jointscope.tools.rerun_log.entities.tab_contents import document_view, plot_columns, plot_view, send_document
from jointscope.tools.rerun_log.entities.tabbed_blueprint import tabbed_blueprint
from jointscope.tools.rerun_log.entities.viewer_text import entity, viewer_text
from jointscope.tools.verdicts.judgement import judge

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

SIGNS = {"good": "✓", "info": "·", "warn": "(!)", "bad": "(!!)"}
PLOTS = (("position", "rad"), ("deflection", "rad"), ("v_link", "rad/s"), ("v_motor", "rad/s"))


def log_calibration(result: CalibrationResult, path: str | Path) -> None:
    """Writes the file; it opens with one tab per question.

    Args:
        result: what the calibration found.
        path: file to write; an existing one is replaced.

    Raises:
        JointscopeError: the file cannot be written; nothing is left behind.
    """
    expected = 8 * sum(
        bag.states.size * 2 + 12 * s.measured.size for bag in result.bags for s in bag.residuals.values()
    )
    with rrd_file(path, _blueprint(result), expected) as stream:
        send_document(stream, "findings", findings_text(result))
        send_covariance(stream, result)
        for i, bag in enumerate(result.bags):
            root = _root(result, i)
            _send_sensors(stream, bag, root)
            _send_states(stream, result.robot, bag, root)
            send_robot(stream, result.robot, bag, root)


def _root(result: CalibrationResult, bag: int) -> str:
    """Entities of several recordings live in folders of their own."""
    return "" if len(result.bags) == 1 else f"bag{bag + 1}"


def _blueprint(result: CalibrationResult) -> rrb.Blueprint:
    import rerun.blueprint as rrb

    tabs: list[rrb.View | rrb.Container] = [document_view("findings")]
    for i, bag in enumerate(result.bags):
        root = _root(result, i)
        own: list[rrb.View | rrb.Container] = [
            _sensor_views(bag, root, "residuals"),
            _state_views(result.robot, root),
            _sensor_views(bag, root, "signals"),
            robot_view(result.robot, root),
        ]
        tabs += own if not root else [rrb.Tabs(*own, name=viewer_text(bag_name(bag, i)))]
    tabs.insert(3 if len(result.bags) == 1 else 1, covariance_views())
    return tabbed_blueprint(tabs)


def findings_text(result: CalibrationResult) -> str:
    """Verdict, findings of the calibration and checks as markdown."""
    judgement = judge(result)
    lines = [f"# {judgement.headline}", ""]
    lines += [f"- {text}" for text in result.findings]
    lines += ["", "## Checks", ""]
    lines += [f"- {SIGNS[c.level]} **{c.name}**: {c.text}" for c in judgement.checks]
    if result.weak_directions:
        lines += ["", "## Weak directions", "", *(f"- {d.text}" for d in result.weak_directions)]
    lines += ["", "## Recordings", ""]
    for bag in result.bags:
        lines.append(f"- {bag.recording.path}, sha256 {bag.recording.sha256}")
        lines += [f"    - {notice.text}" for notice in bag.recording.notices]
    return "\n".join(lines)


def _send_sensors(stream: rr.RecordingStream, fit: BagFit, root: str) -> None:
    """Entities residuals/SENSOR/CHANNEL and signals/SENSOR/CHANNEL below `root`."""
    for name, series in fit.residuals.items():
        for i, channel in enumerate(series.channels):
            column = slice(i, i + 1)
            measured, predicted, sigma = (x[:, column] for x in (series.measured, series.predicted, series.sigma))
            colour, t = [JOINT_COLOURS[i % len(JOINT_COLOURS)]], series.times
            residuals, signals = entity(root, "residuals", name, channel), entity(root, "signals", name, channel)
            send_lines(stream, f"{residuals}/residual", t, measured - predicted, ["residual"], colour)
            send_band(stream, f"{residuals}/band", t, 0.0 * sigma, 3.0 * sigma, [WHITE])
            send_lines(stream, f"{signals}/measured", t, measured, ["measured"], [GREY], 2.5)
            send_lines(stream, f"{signals}/predicted", t, predicted, ["predicted"], colour, 1.2)


def _sensor_views(fit: BagFit, root: str, kind: str) -> rrb.Horizontal:
    """One column per sensor, one plot per channel; `kind` is "residuals" or "signals"."""
    columns = [
        [
            plot_view(f"{channel} [{unit}]", root, kind, name, channel, legend=kind == "signals")
            for channel, unit in zip(series.channels, series.units, strict=True)
        ]
        for name, series in fit.residuals.items()
    ]
    title = kind if kind == "residuals" else "measured and predicted"
    return plot_columns(columns, title, list(fit.residuals))


def _send_states(stream: rr.RecordingStream, robot: Robot, fit: BagFit, root: str) -> None:
    """Entities states/JOINT/QUANTITY below `root`."""
    n, t = robot.n, fit.ticks
    states, sigmas = robot.layout.by_joint(fit.states), robot.layout.by_joint(fit.sigmas)
    encoder = fit.residuals.get(robot.motor_encoder.name)
    for i, joint in enumerate(robot.joints):
        path, colour = entity(root, "states", joint), JOINT_COLOURS[i % 6]
        q_link, v_link, q_motor, v_motor = (states[:, k * n + i] for k in range(4))
        s_q_link, s_v_link, _, s_v_motor = (sigmas[:, k * n + i] for k in range(4))
        if encoder is not None:
            measured = encoder.measured[:, i : i + 1]
            send_lines(stream, f"{path}/position/measured", encoder.times, measured, ["measured"], [GREY], 2.5)
        both = np.column_stack([q_link, q_motor])
        dim = (colour[0] // 2 + 60, colour[1] // 2 + 60, colour[2] // 2 + 60)
        send_lines(stream, f"{path}/position/estimated", t, both, ["q_link", "q_motor"], [colour, dim])
        for name, value, sigma in (
            ("deflection", q_link - q_motor, s_q_link),
            ("v_link", v_link, s_v_link),
            ("v_motor", v_motor, s_v_motor),
        ):
            send_lines(stream, f"{path}/{name}/value", t, value[:, None], [name], [colour])
            send_band(stream, f"{path}/{name}/band", t, value[:, None], 3.0 * sigma[:, None], [colour])


def _state_views(robot: Robot, root: str) -> rrb.Horizontal:
    """One column per joint, one row per quantity."""
    columns = [
        [
            plot_view(f"{joint} {name} [{robot.unit_at(joint, unit)}]", root, "states", joint, name)
            for name, unit in PLOTS
        ]
        for joint in robot.joints
    ]
    return plot_columns(columns, "states")
