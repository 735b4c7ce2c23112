# SPDX-License-Identifier: BSD-3-Clause
"""All controllers and sources side by side."""

from __future__ import annotations

from collections.abc import Callable

from jointscope.tools.closed_loop.closed_loop_result import ClosedLoopResult, LoopRun
from jointscope.tools.closed_loop.planning.tracking import Tracking
from jointscope.tools.presentation.numbers import percent, significant
from jointscope.tools.report.page.page import Section, table
from jointscope.tools.report.sections.closed_loop.loop_colours import by_controller, swatch

Column = tuple[str, Callable[[Tracking], float | None], Callable[[float], str]]


def _milli(value: float) -> str:
    return significant(1e3 * value)


COLUMNS: tuple[Column, ...] = (
    ("E_rms [rad]", lambda t: t.e_rms, significant),
    ("link [mrad]", lambda t: t.link_position_rms, _milli),
    ("link [rad/s]", lambda t: t.link_velocity_rms, significant),
    ("hit [mm]", lambda t: t.hit_position, _milli),
    ("hit [m/s]", lambda t: t.hit_velocity, significant),
    ("over [mrad]", lambda t: t.overshoot, _milli),
    ("settled [s]", lambda t: t.settling, lambda value: f"{value:.2f}"),
    ("effort", lambda t: t.effort, lambda value: f"{value:.3f}"),
    ("chatter", lambda t: t.chatter, lambda value: f"{value:.4f}"),
    ("saturated", lambda t: t.saturated, percent),
)


def loop_scores(result: ClosedLoopResult) -> Section:
    """One row per run; the best of each column that a real robot could reach is bold."""
    rows = []
    for title, runs in by_controller(result):
        rows += [
            [f'<span class="nowrap">{title}</span>' if k == 0 else "", swatch(run), *_cells(run, result)]
            for k, run in enumerate(runs)
        ]
    head = ["controller", "state from", *(name for name, _, _ in COLUMNS)]
    lead = (
        "E_rms: sum of the root mean squares of true − planned of all links and motors over the whole run. Link: root "
        "mean square of those of the links. Hit: the same for the head at the hits, or turning points. Over: "
        "the largest way of a joint past its home after the planned arrival; settled: median time from then until the "
        "head stays within 2 % of its stroke. Effort and chatter: root mean square of the command and of its change "
        "per tick, as shares of the full command; saturated: share of the time at the limit. Bold: best without the "
        "true state."
    )
    return Section("scores", "Side by side", table(head, rows, list(range(2, len(head)))), lead)


def _cells(run: LoopRun, result: ClosedLoopResult) -> list[str]:
    cells = []
    for _, value_of, text_of in COLUMNS:
        value = value_of(run.tracking)
        if value is None:
            cells.append("never")
            continue
        found = [value_of(other.tracking) for other in result.runs if other.source != "true"]
        others = [v for v in found if v is not None]
        best = run.source != "true" and value <= min(others) < max(others)
        cells.append(f'<span class="best">{text_of(value)}</span>' if best else text_of(value))
    return cells
