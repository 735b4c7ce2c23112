# SPDX-License-Identifier: BSD-3-Clause
"""The commands of every run around the first hit: noise in the state is noise in the command."""

from __future__ import annotations

from jointscope.robots.units import si_unit
from jointscope.tools.closed_loop.closed_loop_result import SOURCES, ClosedLoopResult, LoopRun
from jointscope.tools.report.page.page import Section, figure
from jointscope.tools.report.page.panels import below_each_other
from jointscope.tools.report.page.plot import Axes, Curve, Mark
from jointscope.tools.report.sections.closed_loop.loop_colours import COLOURS, by_controller, source_keys


def loop_commands(result: ClosedLoopResult) -> Section:
    """One figure per controller, one panel per joint."""
    body = ""
    for title, runs in by_controller(result):
        body += f"<h3>{title}</h3>" + figure(_panels(result, runs), source_keys(runs), group="commands")
    lead = "Commands from just before the first hit until the head is home again, as shares of the full command."
    return Section("commands", "Commands", body, lead)


def _panels(result: ClosedLoopResult, runs: list[LoopRun]) -> list[str]:
    plan, hit = result.plan, result.plan.hits[0]
    rows = slice(plan.tick(hit.start - 0.1), plan.tick(hit.back + 0.2) + 1)
    panels = []
    for i, joint in enumerate(result.robot.joints):
        marks: list[Mark] = [
            Curve(SOURCES[run.source], plan.times[rows], run.commands[rows, i] / result.full[i], COLOURS[run.source])
            for run in sorted(runs, key=lambda run: run.tracking.chatter, reverse=True)
        ]
        full = f"{result.full[i]:g} {si_unit(result.robot.command.unit)}".replace(" 1", "")
        title = f"{joint}, share of {full}" if result.robot.command.unit != "duty" else f"{joint}, duty cycle"
        panels.append((Axes(title, height=120), marks))
    return below_each_other(panels)
