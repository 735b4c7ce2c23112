# SPDX-License-Identifier: BSD-3-Clause
"""Error of every step on training and held-out recordings, as bars from the floor's left, logarithmic."""

from __future__ import annotations

import math
from html import escape

from jointscope.graphs.discovery.discovery_result import Discovery, DiscoveryStep
from jointscope.tools.presentation.candidate_numbers import share_text
from jointscope.tools.presentation.model_answer import unexplained_share
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.page import Key, Section, figure, table
from jointscope.tools.report.page.scale import log_ticks

LEFT, BAR, RIGHT = 300, 640, 100  # [px] names, longest bar, numbers
ROW = 52  # [px]
LEAST = 0.5  # [sensor sigma] left end of the axis
AXIS = "error [sensor sigma]: blue training recordings, orange held out, mark: floor"
TRAINING, HELD_OUT = "m0", "m1"


def waterfall(result: Discovery) -> Section:
    """Bars and the same as a table."""
    lead = (
        f"Error {result.judged_by}, root mean square over all channels, in sensor sigmas. Training: on the "
        "recordings that every step was calibrated with, nothing left out. The held-out recording is scored once per "
        "step and never influences the choice. Mark: the floor, what noise and the uncertainty of the state alone "
        "would give."
    )
    keys = [Key("training recordings", TRAINING, "thick")]
    keys += [Key("held-out recording", HELD_OUT, "thick")] if result.held_out else []
    body = figure([waterfall_picture(result)], [*keys, Key("floor", "ink", "thick")]) + _table(result)
    return Section("waterfall", "Step by step", body, lead)


def waterfall_picture(result: Discovery, bar: int = BAR) -> str:
    """Two bars per step and the floor as a mark on them; the longest bar has `bar` pixels."""
    errors = [e for step in result.steps for e in (step.train_error, step.heldout_error) if math.isfinite(e)]
    largest = 1.15 * max([2.0, *errors])
    height = ROW * len(result.steps)

    def at(value: float) -> float:
        return bar * max(math.log(max(value, LEAST) / LEAST), 0.004) / math.log(largest / LEAST)

    ticks = "".join(
        f'<path class="grid" d="M{LEFT + at(v):.1f} 0V{height}"/>'
        f'<text class="x" x="{LEFT + at(v):.1f}" y="{height + 15}">{label}</text>'
        for v, label in log_ticks(LEAST, largest)
    )
    rows = "".join(_row(step, k, at) for k, step in enumerate(result.steps))
    return (
        f'<svg viewBox="0 0 {LEFT + bar + RIGHT} {height + 36}" role="img" aria-label="error of every step">{ticks}'
        f'{rows}<text class="xlabel" x="{LEFT + bar / 2:.0f}" y="{height + 31}">{AXIS}</text></svg>'
    )


def _row(step: DiscoveryStep, k: int, at: object) -> str:
    assert callable(at)
    top = ROW * k + 7
    floor = LEFT + float(at(step.floor))
    parts = [f'<text class="end name" x="{LEFT - 12}" y="{top + 18}">{escape(f"{k}: {step.label}")}</text>']
    for i, (error, colour) in enumerate(((step.train_error, TRAINING), (step.heldout_error, HELD_OUT))):
        if math.isfinite(error):
            y, length = top + 19 * i, float(at(error))
            parts.append(
                f'<rect class="fill {colour}" x="{LEFT}" y="{y}" width="{length:.1f}" height="15"/>'
                f'<text class="name" x="{max(LEFT + length, floor) + 7:.1f}" y="{y + 8}">{significant(error)} σ</text>'
            )
    parts.append(f'<path class="mark ink" stroke-width="2.6" d="M{floor:.1f} {top - 4}v42"/>')
    return "".join(parts)


def _table(result: Discovery) -> str:
    held_out = ["held out [σ]"] if result.held_out else []
    head = ["step", "change", "training [σ]", *held_out, "floor [σ]", "unexplained", "robot file"]
    rows = [
        [
            str(k),
            f"<code>{escape(step.label)}</code>",
            significant(step.train_error),
            *([significant(step.heldout_error)] if result.held_out else []),
            significant(step.floor),
            share_text(unexplained_share(step)),
            f"<code>{escape(step.robot_file)}</code>" if step.robot_file else "—",
        ]
        for k, step in enumerate(result.steps)
    ]
    return table(head, rows, range(2, len(head) - 1))
