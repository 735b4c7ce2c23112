# SPDX-License-Identifier: BSD-3-Clause
"""Every hit: what was wanted, and how far each run was off."""

from __future__ import annotations

import numpy as np

from jointscope.tools.closed_loop.closed_loop_result import SOURCES, ClosedLoopResult, LoopRun
from jointscope.tools.presentation.numbers import minus, significant
from jointscope.tools.report.page.page import Section, table
from jointscope.tools.report.sections.closed_loop.loop_colours import by_controller


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
