# SPDX-License-Identifier: BSD-3-Clause
"""A calibration as an .rrd file: residuals, states with sigma, covariance, robot in 3D, findings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.tools.presentation.sensor_signals import bag_name
from jointscope.tools.rerun_log.entities.covariance_picture import covariance_views, send_covariance
from jointscope.tools.rerun_log.entities.moving_robot import robot_view, send_robot
from jointscope.tools.rerun_log.entities.rrd_file import rrd_file
from jointscope.tools.rerun_log.entities.sensor_lines import send_sensors, sensor_views
from jointscope.tools.rerun_log.entities.state_lines import send_states, state_views
from jointscope.tools.rerun_log.entities.tabbed_blueprint import tabbed_blueprint
from jointscope.tools.rerun_log.entities.viewer_text import viewer_text
from jointscope.tools.verdicts.judgement import judge

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

SIGNS = {"good": "✓", "info": "·", "warn": "(!)", "bad": "(!!)"}


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
        _send_findings(stream, result)
        send_covariance(stream, result)
        for i, bag in enumerate(result.bags):
            root = _root(result, i)
            send_sensors(stream, bag, root)
            send_states(stream, result.robot, bag, root)
            send_robot(stream, result.robot, bag, root)


def _root(result: CalibrationResult, bag: int) -> str:
    """Entities of several recordings live in folders of their own."""
    return "" if len(result.bags) == 1 else f"bag{bag + 1}"


def _blueprint(result: CalibrationResult) -> rrb.Blueprint:
    import rerun.blueprint as rrb

    findings = rrb.TextDocumentView(origin="/findings", name="findings")
    tabs: list[rrb.View | rrb.Container] = [findings]
    for i, bag in enumerate(result.bags):
        root = _root(result, i)
        own: list[rrb.View | rrb.Container] = [
            sensor_views(bag, root, "residuals"),
            state_views(result.robot, root),
            sensor_views(bag, root, "signals"),
            robot_view(result.robot, root),
        ]
        tabs += own if not root else [rrb.Tabs(*own, name=viewer_text(bag_name(bag, i)))]
    tabs.insert(3 if len(result.bags) == 1 else 1, covariance_views())
    return tabbed_blueprint(tabs)


def _send_findings(stream: rr.RecordingStream, result: CalibrationResult) -> None:
    import rerun as rr

    document = rr.TextDocument(viewer_text(findings_text(result)), media_type=rr.MediaType.MARKDOWN)
    stream.log("findings", document, static=True)


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
