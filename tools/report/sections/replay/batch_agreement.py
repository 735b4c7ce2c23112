# SPDX-License-Identifier: BSD-3-Clause
"""States at the lag against the batch smoother, in sigmas: by state and over time."""

from __future__ import annotations

from html import escape

import numpy as np

from jointscope.graphs.fixed_lag.replay.batch_agreement import FAR, LARGEST_RMS, LARGEST_SHARE
from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult
from jointscope.tools.presentation.numbers import minus, percent, significant
from jointscope.tools.presentation.sensor_signals import COLOURS
from jointscope.tools.report.page.page import Key, Section, figure, table
from jointscope.tools.report.page.plot import Axes, Curve, plot

WORST = 4


def agreement(result: ReplayResult) -> Section:
    """A table per state, and the states that are furthest away over time."""
    lead = (
        "The batch smoother has seen the whole recording, with the same model and noise. If both are right they differ "
        "by less than the sigma at the lag."
    )
    found = result.agreement
    if found is None:
        return Section("batch", "Against the batch smoother", f"<p>{escape(_reason(result))}</p>", lead)
    rows = []
    for i, name in enumerate(found.names):
        good = found.rms[i] <= LARGEST_RMS and found.far_share[i] <= LARGEST_SHARE
        tone = f'<span class="{"good" if good else "bad"}" style="color:var(--tone)">{significant(found.rms[i])}</span>'
        rows.append([f"<code>{escape(name)}</code>", tone, percent(found.far_share[i])])
    head = ["state", "rms distance [sigma]", f"further than {FAR:g} sigma"]
    worst = np.argsort(-found.rms)[:WORST]
    curves = [Curve(found.names[i], found.times, found.in_sigmas[:, i], COLOURS[k]) for k, i in enumerate(worst)]
    levels = [(value, minus(f"{value:g} sigma")) for value in (-FAR, FAR)]
    axes = Axes("lagged − batch [sigma]", height=220, levels=levels)
    keys = [Key(found.names[i], COLOURS[k]) for k, i in enumerate(worst)]
    body = table(head, rows, [1, 2]) + figure([plot(axes, curves)], keys, group="replay")
    return Section("batch", "Against the batch smoother", body, lead)


def _reason(result: ReplayResult) -> str:
    return result.no_agreement or "Not compared; `jointscope replay --batch` does it."
