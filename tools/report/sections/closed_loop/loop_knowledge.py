# SPDX-License-Identifier: BSD-3-Clause
"""What the controllers knew of the state against the truth, and a closer look at one hit."""

from __future__ import annotations

import numpy as np

from jointscope.tools.closed_loop.closed_loop_result import SOURCES, ClosedLoopResult, LoopRun
from jointscope.tools.presentation.numbers import prefixed, significant
from jointscope.tools.report.page.page import Section, figure, table
from jointscope.tools.report.page.panels import below_each_other
from jointscope.tools.report.page.plot import Axes, Curve, Mark
from jointscope.tools.report.sections.closed_loop.loop_colours import COLOURS, by_controller, source_keys, swatch

NAMES = ("q_link", "v_link", "q_motor", "v_motor")
UNITS = ("rad", "rad/s", "rad", "rad/s")


def loop_knowledge(result: ClosedLoopResult) -> Section:
    """A table of all runs, then curves of one hit under the first controller."""
    runs = [run for run in result.runs if run.source != "true"]
    if not runs:
        body = "<p>Only the true state was used.</p>"
        return Section("knowledge", "What the controllers knew", body)
    rows = []
    for title, group in by_controller(result):
        known = [run for run in group if run.source != "true"]
        rows += [[title if k == 0 else "", swatch(run), *_cells(run)] for k, run in enumerate(known)]
    head = ["controller", "state from", "q_link [mrad]", "v_link [rad/s]", "q_motor [mrad]", "v_motor [rad/s]"]
    lead = (
        "Root mean square of known − true over all joints. Differentiated encoders take the springs' stretch from the "
        "plan, so their link is as wrong as the robot is off the plan."
    )
    title, group = by_controller(result)[0]
    known = [run for run in group if run.source != "true"]
    closer = f"<h3>{title}: the first hit</h3>" + figure(_panels(result, known), source_keys(known)) if known else ""
    body = table(head, rows, [2, 3, 4, 5]) + closer
    return Section("knowledge", "What the controllers knew", body, lead)


def _cells(run: LoopRun) -> list[str]:
    return [
        significant((1e3 if unit == "rad" else 1.0) * run.tracking.estimation[name])
        for name, unit in zip(NAMES, UNITS, strict=True)
    ]


def _panels(result: ClosedLoopResult, runs: list[LoopRun]) -> list[str]:
    """Known - true of link angle and velocity of every joint from before the first hit to its end."""
    plan, n = result.plan, result.plan.q.shape[1]
    hit = plan.hits[0]
    rows = slice(plan.tick(hit.start - 0.1), plan.tick(hit.back + 0.2) + 1)
    t, panels = plan.times[rows], []
    quantities = [(0, "link angle", "rad"), (n, "link velocity", "rad/s")]
    for first, name, unit in quantities:
        errors = [run.estimates[rows, first : first + n] - run.states[rows, first : first + n] for run in runs]
        factor, prefixed_unit = prefixed(max(float(np.max(np.abs(e))) for e in errors), unit)
        for i, joint in enumerate(result.robot.joints):
            marks: list[Mark] = [
                Curve(SOURCES[run.source], t, factor * e[:, i], COLOURS[run.source])
                for run, e in zip(reversed(runs), reversed(errors), strict=True)
            ]
            title = f"{joint} {name}, known − true [{prefixed_unit}]"
            panels.append((Axes(title, height=110), marks))
    return below_each_other(panels)
