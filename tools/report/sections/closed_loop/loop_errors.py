# SPDX-License-Identifier: BSD-3-Clause
"""What runs do: errors of head and links over time, every hit, and the commands around the first of them."""

from __future__ import annotations

import numpy as np

from jointscope.robots.units import si_unit
from jointscope.tools.closed_loop.closed_loop_result import SOURCES, ClosedLoopResult, LoopRun
from jointscope.tools.presentation.numbers import minus, prefixed, significant
from jointscope.tools.report.page.page import Key, Section, figure, table
from jointscope.tools.report.page.panels import below_each_other
from jointscope.tools.report.page.plot import Axes, Curve, Mark
from jointscope.tools.report.sections.closed_loop.loop_colours import COLOURS, by_controller, source_keys

LEAST = 1e-5  # [m] below this the logarithmic axis ends


def loop_errors(result: ClosedLoopResult) -> Section:
    """One figure per controller."""
    body = ""
    for title, runs in by_controller(result):
        body += f"<h3>{title}</h3>" + figure(_panels(result, runs), source_keys(runs), group="loop")
    lead = "Drag to look closer, double click for the whole time; all figures follow."
    return Section("errors", "Errors over time", body + _planned(result), lead)


def _panels(result: ClosedLoopResult, runs: list[LoopRun]) -> list[str]:
    t, n = result.plan.times, result.plan.q.shape[1]
    distance: list[Mark] = [
        _curve(run, t, np.maximum(1e3 * np.linalg.norm(run.head - result.head, axis=1), 1e3 * LEAST)) for run in runs
    ]
    panels = [(Axes("head, distance from the plan [mm]", height=190, log_y=True), distance)]
    worst = max(float(np.max(np.abs(run.states[:, :n] - result.plan.q))) for run in runs)
    factor, unit = prefixed(worst, "rad")
    for i, joint in enumerate(result.robot.joints):
        errors: list[Mark] = [_curve(run, t, factor * (run.states[:, i] - result.plan.q[:, i])) for run in runs]
        panels.append((Axes(f"{joint} link, true − planned [{unit}]", height=120), errors))
    return below_each_other(panels)


def _planned(result: ClosedLoopResult) -> str:
    """The plan itself, and where the hits are in it."""
    t, names = result.plan.times, result.robot.joints
    hits = [hit.time for hit in result.plan.hits]
    panels = []
    for title, values in (("planned link angle [rad]", result.plan.q), ("planned velocity [rad/s]", result.plan.v)):
        marks: list[Mark] = [Curve(name, t, values[:, i], f"k{i % 6}") for i, name in enumerate(names)]
        at = np.array([values[result.plan.tick(time)] for time in hits])
        marks += [_dots(f"hit {names[i]}", np.array(hits), at[:, i], f"k{i % 6}") for i in range(len(names))]
        panels.append((Axes(title, height=150), marks))
    keys = [Key(name, f"k{i % 6}") for i, name in enumerate(names)]
    return "<h3>The plan</h3>" + figure(below_each_other(panels), keys, "Dots are the hits.", group="loop")


def _dots(name: str, times: np.ndarray, values: np.ndarray, colour: str) -> Curve:
    """Single points: each is a short stroke, and NaN lifts the pen between them."""
    x = np.repeat(times, 3)
    x[1::3] += 1e-4
    x[2::3] += 2e-4
    y = np.repeat(values, 3)
    y[2::3] = np.nan
    return Curve(name, x, y, colour, "dots")


def _curve(run: LoopRun, t: np.ndarray, y: np.ndarray) -> Curve:
    return Curve(SOURCES[run.source], t, y, COLOURS[run.source])


def loop_hits(result: ClosedLoopResult) -> Section:
    """One table per controller: one row per hit, one column per source."""
    body = "".join(f"<h3>{title}</h3>{_table(result, runs)}" for title, runs in by_controller(result))
    lead = (
        "Where the head should be, how fast, and the distance and the error of the velocity of each run at that very "
        "moment. Places and directions are random."
    )
    return Section("hits", "Hit by hit", body, lead)


def _table(result: ClosedLoopResult, runs: list[LoopRun]) -> str:
    plan, step = result.plan, float(result.plan.times[1] - result.plan.times[0])
    speed = np.linalg.norm(np.gradient(result.head, step, axis=0), axis=1)
    rows = []
    for k, hit in enumerate(plan.hits):
        at = plan.tick(hit.time)
        place = minus(", ".join(f"{x:.2f}" for x in result.head[at]))
        errors = [run.tracking.hits[k] for run in runs]
        cells = [f"{significant(1e3 * e.position)} mm, {significant(e.velocity, 2)} m/s" for e in errors]
        rows.append([f"{hit.time:.2f} s", place, f"{speed[at]:.2f} m/s", *cells])
    head = ["time", "place x, y, z [m]", "speed", *(SOURCES[run.source] for run in runs)]
    return table(head, rows, list(range(1, len(head))))


def loop_commands(result: ClosedLoopResult) -> Section:
    """One figure per controller, one panel per joint."""
    body = ""
    for title, runs in by_controller(result):
        body += f"<h3>{title}</h3>" + figure(_command_panels(result, runs), source_keys(runs), group="commands")
    lead = "Commands from just before the first hit until the head is home again, as shares of the full command."
    return Section("commands", "Commands", body, lead)


def _command_panels(result: ClosedLoopResult, runs: list[LoopRun]) -> list[str]:
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
