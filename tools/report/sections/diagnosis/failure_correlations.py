# SPDX-License-Identifier: BSD-3-Clause
"""What the prediction errors go along with: their correlation with the signals that drive the robot."""

from __future__ import annotations

import math

from jointscope.graphs.comparison.failure_analysis import FailureAnalysis
from jointscope.tools.presentation.numbers import minus
from jointscope.tools.report.page.heat_table import HeatCell, heat_table
from jointscope.tools.report.page.page import Section

PRINTED = 0.1


def failure_correlations(failure: FailureAnalysis) -> Section:
    """One row per signal, one column per channel."""
    lead = (
        "Correlation of the 0.1 s ahead error of each channel with velocities, positions, loads and commands. Blue: "
        "same sign, orange: opposite. Commands come from a controller that sees the same errors, so a correlation with "
        "the command alone proves nothing."
    )
    # by joint; within a joint in the order of the worst channel, which has its strongest first
    found = dict.fromkeys(s for c in failure.channels.values() for s in c.correlations)
    signals = sorted(found, key=lambda signal: signal.partition(".")[0])
    title = "What the errors go along with"
    if not signals:
        return Section("correlations", title, "<p>Correlations were not computed.</p>", lead)
    rows = [
        (signal, [_cell(name, signal, c.correlations.get(signal, math.nan)) for name, c in failure.channels.items()])
        for signal in signals
    ]
    return Section("correlations", title, heat_table("signal", list(failure.channels), rows), lead)


def _cell(channel: str, signal: str, r: float) -> HeatCell:
    if not math.isfinite(r):
        return HeatCell("—", 0.0)
    text = minus(f"{r:+.2f}") if abs(r) >= PRINTED else ""
    return HeatCell(text, abs(r), "k0" if r < 0 else "k2", f"{channel} with {signal}: {minus(f'{r:+.3f}')}")
