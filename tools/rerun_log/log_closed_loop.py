# SPDX-License-Identifier: BSD-3-Clause
"""Closed loops as an .rrd file: errors, commands, what was known, and the heads of all runs in 3D."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from jointscope.tools.closed_loop.closed_loop_result import CONTROLLERS, SOURCES, ClosedLoopResult, LoopRun
from jointscope.tools.report.sections.closed_loop.loop_answer import loop_judgement
from jointscope.tools.rerun_log.entities.columns import GREY, WHITE, Colour, send_lines, thinned, time_column
from jointscope.tools.rerun_log.entities.moving_robot import robot_view, send_bodies
from jointscope.tools.rerun_log.entities.rrd_file import rrd_file
from jointscope.tools.rerun_log.entities.tab_contents import document_view, plot_columns, plot_view, send_document
from jointscope.tools.rerun_log.entities.tabbed_blueprint import tabbed_blueprint
from jointscope.tools.rerun_log.entities.viewer_text import entity, viewer_text
from jointscope.tools.terminal.closed_loop_text import closed_loop_text

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

COLOURS: dict[str, Colour] = {"true": (40, 190, 145), "estimator": (75, 165, 235), "encoders": (240, 110, 60)}
FRAMES = 100.0  # [1/s] of what moves in 3D
SPOT = 0.02  # [m] radius of a head


def log_closed_loop(result: ClosedLoopResult, path: str | Path) -> None:
    """Writes the file; it opens with what was found.

    Args:
        result: all runs.
        path: file to write; an existing one is replaced.

    Raises:
        JointscopeError: the file cannot be written; nothing is left behind.
    """
    expected = 8 * sum(3 * run.states.size for run in result.runs)
    with rrd_file(path, _blueprint(result), expected) as stream:
        send_document(stream, "findings", _findings(result))
        for run in result.runs:
            _send_run(stream, result, run)
        _send_robot(stream, result)


def _blueprint(result: ClosedLoopResult) -> rrb.Blueprint:
    tabs: list[rrb.View | rrb.Container] = [document_view("findings")]
    for controller, name in CONTROLLERS.items():
        if any(run.controller == controller for run in result.runs):
            tabs.append(_controller_views(result, controller, name))
    return tabbed_blueprint([*tabs, robot_view(result.robot, "")])


def _controller_views(result: ClosedLoopResult, controller: str, name: str) -> rrb.Vertical:
    import rerun.blueprint as rrb

    plots = (
        ("link_error", "link error [rad]"),
        ("v_error", "link velocity known − true [rad/s]"),
        ("command", "command, share"),
    )
    head = plot_view("head, distance from the plan [m]", "loops", controller, "head")
    columns = plot_columns(
        [plot_view(f"{joint} {title}", "loops", controller, joint, what) for what, title in plots]
        for joint in result.robot.joints
    )
    return rrb.Vertical(head, columns, row_shares=[1, 3], name=viewer_text(name))


def _findings(result: ClosedLoopResult) -> str:
    answer = loop_judgement(result)
    return f"# {answer.headline}\n\n{answer.why}\n\n```\n{closed_loop_text(result)}\n```"


def _send_run(stream: rr.RecordingStream, result: ClosedLoopResult, run: LoopRun) -> None:
    t, n, name, colour = result.plan.times, result.robot.n, [SOURCES[run.source]], [COLOURS[run.source]]
    root = entity("loops", run.controller)
    distance = np.linalg.norm(run.head - result.head, axis=1)
    send_lines(stream, f"{root}/head/{run.source}", t, distance[:, None], name, colour)
    for i, joint in enumerate(result.robot.joints):
        for what, values in (
            ("link_error", run.states[:, i] - result.plan.q[:, i]),
            ("v_error", run.estimates[:, n + i] - run.states[:, n + i]),
            ("command", run.commands[:, i] / result.full[i]),
        ):
            send_lines(
                stream, entity("loops", run.controller, joint, what, run.source), t, values[:, None], name, colour
            )


def _send_robot(stream: rr.RecordingStream, result: ClosedLoopResult) -> None:
    """The robot as planned, and the heads of all runs with their paths."""
    import rerun as rr

    plan = result.plan
    keep = thinned(len(plan.times), max(int(FRAMES * (plan.times[-1] - plan.times[0])), 2))
    send_bodies(stream, result.robot, plan.times[keep], plan.q[keep], "")
    stream.log("robot/plan", rr.LineStrips3D([result.head[keep]], colors=[GREY], radii=0.003), static=True)
    hits = [result.head[plan.tick(hit.time)] for hit in plan.hits]
    stream.log("robot/hits", rr.Points3D(hits, radii=2 * SPOT, colors=[WHITE]), static=True)
    for run in result.runs:
        path, colour = entity("robot", "heads", run.controller, run.source), _colour_in_3d(run)
        stream.log(f"{path}/path", rr.LineStrips3D([run.head[keep]], colors=[colour], radii=0.002), static=True)
        spots = rr.Points3D.columns(positions=run.head[keep], radii=[SPOT] * len(keep), colors=[colour] * len(keep))
        stream.send_columns(f"{path}/now", [time_column(plan.times[keep])], spots)


def _colour_in_3d(run: LoopRun) -> Colour:
    """The P-controller's heads are darker, as both controllers are in one picture."""
    red, green, blue = COLOURS[run.source]
    return (red // 2, green // 2, blue // 2) if run.controller == "p" else (red, green, blue)
