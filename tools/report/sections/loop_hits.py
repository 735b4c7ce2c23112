# SPDX-License-Identifier: BSD-3-Clause
"""Every hit: what was wanted, and how far each run was off."""

from __future__ import annotations

import numpy as np

from jointscope.tools.closed_loop.closed_loop_result import CONTROLLERS, SOURCES, ClosedLoopResult
from jointscope.tools.report.numbers import significant
from jointscope.tools.report.page import Section, table


def loop_hits(result: ClosedLoopResult) -> Section:
    """One row per hit, one column per run."""
    plan, step = result.plan, float(result.plan.times[1] - result.plan.times[0])
    speed = np.linalg.norm(np.gradient(result.head, step, axis=0), axis=1)
    runs = sorted(result.runs, key=lambda run: list(CONTROLLERS).index(run.controller), reverse=True)
    rows = []
    for k, hit in enumerate(plan.hits):
        at = plan.tick(hit.time)
        place = ", ".join(f"{x:.2f}" for x in result.head[at])
        errors = [run.tracking.hits[k] for run in runs]
        cells = [f"{significant(1e3 * e.position)} mm<br>{significant(e.velocity)} m/s" for e in errors]
        rows.append([f"{hit.time:.2f} s", place, f"{speed[at]:.2f} m/s", *cells])
    names = [f"{CONTROLLERS[run.controller]}, {SOURCES[run.source]}" for run in runs]
    head = ["time", "place x, y, z [m]", "speed", *names]
    lead = (
        "Where the head should be, how fast, and the distance and the error of the velocity of each run at that very "
        "moment. The directions are random."
    )
    return Section("hits", "Hit by hit", table(head, rows, list(range(2, len(head)))), lead)
