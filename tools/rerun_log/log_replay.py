# SPDX-License-Identifier: BSD-3-Clause
"""A replay as an .rrd file: an overview, residuals, NIS, states, covariance, the robot in 3D, events, latency."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from jointscope.graphs.fixed_lag.replay.replay_result import CovarianceSeries, ReplayResult, StateSeries
from jointscope.robots.model.robot import Robot
from jointscope.tools.presentation.tip_ellipsoid import link_coordinates
from jointscope.tools.rerun_log.entities.correlation_over_time import correlation_view, send_correlations
from jointscope.tools.rerun_log.entities.estimate_lines import (
    bias_views,
    correction_views,
    estimate_views,
    joint_views,
    send_corrections,
    send_estimate_lines,
    sigma_views,
)
from jointscope.tools.rerun_log.entities.event_lines import event_view, latency_views, send_events, send_latency
from jointscope.tools.rerun_log.entities.innovation_lines import innovation_views, nis_views, send_innovations, send_nis
from jointscope.tools.rerun_log.entities.moving_robot import robot_view, send_estimate
from jointscope.tools.rerun_log.entities.rrd_file import rrd_file
from jointscope.tools.rerun_log.entities.tab_contents import document_view, send_document
from jointscope.tools.rerun_log.entities.tabbed_blueprint import tabbed_blueprint
from jointscope.tools.rerun_log.log_calibration import SIGNS
from jointscope.tools.verdicts.replay_judgement import diagnose_command, judge_replay, suspects

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb


def log_replay(result: ReplayResult, path: str | Path) -> None:
    """Writes the file.

    Args:
        result: what the replay gave.
        path: file to write; an existing one is replaced.

    Raises:
        JointscopeError: the file cannot be written; nothing is left behind.
    """
    expected = 8 * (5 * result.states.mean.size + 5 * sum(s.residual.size for s in result.innovations.values()))
    with rrd_file(path, replay_blueprint(result.robot, tuple(result.adapted), result), expected) as stream:
        send_document(stream, "findings", replay_markdown(result))
        send_innovations(stream, result.innovations)
        send_nis(stream, result.innovations)
        send_estimate_lines(stream, result.robot, result.states, result.lagged)
        send_corrections(stream, result.robot, result.states, result.lagged)
        send_correlations(stream, result.robot, result.covariances)
        send_pose(stream, result.robot, result.states, result.covariances)
        send_events(stream, result.events)
        send_latency(stream, result.latency.times, result.latency.seconds)


def replay_blueprint(robot: Robot, adapted: tuple[str, ...] = (), result: ReplayResult | None = None) -> rrb.Blueprint:
    """One tab per question; without a result, while it runs, it opens on the overview and has no verdict yet."""
    import rerun.blueprint as rrb

    overview = rrb.Horizontal(
        rrb.Vertical(robot_view(robot, ""), event_view(), row_shares=[3, 1]),
        joint_views(robot, robot.joints[0]),
        nis_views(robot, legend=False),
        column_shares=[3, 3, 3],
        name="overview",
    )
    covariance = rrb.Horizontal(
        correlation_view(),
        sigma_views(robot, None if result is None else result.states),
        column_shares=[3, 2],
        name="covariance",
    )
    tabs: list[rrb.View | rrb.Container] = [
        *([] if result is None else [document_view("findings")]),
        overview,
        innovation_views(robot, None if result is None else result.innovations),
        nis_views(robot),
        estimate_views(robot),
        *([] if result is None else [correction_views(robot, result.states, result.lagged)]),
        covariance,
        robot_view(robot, ""),
        bias_views(robot, adapted),
        event_view(),
        latency_views(),
    ]
    return tabbed_blueprint(tabs)


def send_pose(
    stream: rr.RecordingStream,
    robot: Robot,
    states: StateSeries,
    covariances: CovarianceSeries,
    magnified: float | None = None,
) -> float | None:
    """The robot in 3D with the ellipsoid, at the times of the covariance matrices; returns the magnification."""
    times, link = covariances.times, robot.layout.q_link
    if not len(times):
        return magnified
    q = link_coordinates(robot, states, times)
    return send_estimate(stream, robot, times, q, covariances.matrices[:, link, link], magnified)


def replay_markdown(result: ReplayResult) -> str:
    """Verdict, checks, what to do next, and counts as markdown."""
    judgement = judge_replay(result)
    lines = [f"# Can this estimate be trusted? {judgement.headline}", ""]
    lines += [f"- {SIGNS[c.level]} **{c.name}**: {c.text}" for c in judgement.checks]
    if suspects(result):
        lines += ["", "## What is missing?", "", f"`{diagnose_command(result)}`"]
    lines += ["", "## The run", ""]
    lines += [
        f"- {result.source.path}, {result.messages} messages, {result.recording_seconds:.2f} s",
        f"- {result.updates} updates, lag {result.lag:g} s, estimated in {result.wall_seconds:.2f} s",
    ]
    if result.stride > 1:
        lines.append(f"- this file holds every {result.stride}th tick; counts and percentiles are those of all")
    lines += ["", "## Events", ""]
    lines += [f"- {kind.replace('_', ' ')}: {count}" for kind, count in result.event_counts.items()]
    return "\n".join(lines)
