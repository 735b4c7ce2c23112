# SPDX-License-Identifier: BSD-3-Clause
"""In which regime of motion each channel fails: a table of channels and regimes, coloured by the error."""

from __future__ import annotations

import math

from jointscope.graphs.comparison.failure_analysis import ChannelFailure, FailureAnalysis
from jointscope.graphs.problem.motion_regimes import REGIMES
from jointscope.tools.presentation.numbers import percent, significant
from jointscope.tools.report.page.heat_table import HeatCell, heat_table
from jointscope.tools.report.page.page import Section


def regimes(failure: FailureAnalysis, id_: str = "regimes") -> Section:
    """One row per channel, worst first; one column per regime that occurs."""
    time = {regime: share for regime, share in failure.time_in_regime.items() if share > 0.0}
    occur = [r for r in REGIMES if r in time] + [r for r in time if r not in REGIMES]
    lead = (
        "Error in sensor sigmas within each regime of motion, and how much of the time is spent there; regimes of "
        "different joints overlap. Under the pointer: the part of the channel's squared error, and the joint whose "
        "motion matters."
    )
    if not occur or not failure.channels:
        return Section(id_, "When the model fails", "<p>The recording is too short to tell regimes apart.</p>", lead)
    largest = max([2.0, *(e for c in failure.channels.values() for e in c.regimes.values() if math.isfinite(e))])
    columns = [f"{r} ({percent(time[r])} of the time)" for r in occur]
    rows = [(name, [_cell(name, c, r, largest) for r in occur]) for name, c in failure.channels.items()]
    return Section(id_, "When the model fails", heat_table("channel", columns, rows), lead)


def _cell(name: str, channel: ChannelFailure, regime: str, largest: float) -> HeatCell:
    error = channel.regimes.get(regime, float("nan"))
    if not math.isfinite(error):
        return HeatCell("—", 0.0)
    strength = math.log(max(error, 1.0)) / math.log(largest)
    share, joint = channel.regime_share.get(regime, float("nan")), channel.joint_of_regime.get(regime, "")
    tip = f"{name}, {regime}: {significant(error)} sigma"
    tip += f", {percent(share)} of its squared error" if math.isfinite(share) else ""
    tip += f", worst while {joint} does that" if joint else ""
    return HeatCell(significant(error), strength, "k0", tip)
