# SPDX-License-Identifier: BSD-3-Clause
"""A replay on one screen: verdict, sensors, states, events, and the command to type next."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult
from jointscope.graphs.fixed_lag.window.state_names import state_names, state_unit
from jointscope.tools.presentation.numbers import prefixed, significant
from jointscope.tools.terminal.text_table import text_table
from jointscope.tools.verdicts.replay_judgement import diagnose_command, judge_replay, suspects

SIGNS = {"good": "ok", "info": "--", "warn": "! ", "bad": "!!"}
SHOWN_EVENTS = 6


def replay_text(result: ReplayResult) -> str:
    """The summary of a replay for the terminal."""
    parts = [_headline(result), _checks(result), _sensors(result), _states(result), _parameters(result)]
    return "\n\n".join(part for part in (*parts, _events(result), hand_over(result)) if part)


def hand_over(result: ReplayResult) -> str:
    """What a NIS alarm means and the command that looks into it; empty without one."""
    off = suspects(result)
    if not off:
        return ""
    worst = off[0]
    return (
        f"{worst.sensor}: the residuals of {worst.channel} are larger than the model expects (NIS "
        f"{significant(worst.nis)} per degree of freedom). Ask what is missing:\n  {diagnose_command(result)}"
    )


def _headline(result: ReplayResult) -> str:
    ratio = result.recording_seconds / result.wall_seconds if result.wall_seconds > 0 else float("nan")
    return (
        f"{result.source.path or 'recording'}: {result.updates} updates over {result.recording_seconds:.1f} s, lag "
        f"{result.lag:g} s, estimated in {result.wall_seconds:.1f} s ({significant(ratio, 2)} times real time)\n"
        f"{judge_replay(result).headline}"
    )


def _checks(result: ReplayResult) -> str:
    return "\n".join(f"  {SIGNS[c.level]} {c.name}: {c.text}" for c in judge_replay(result).checks)


def _sensors(result: ReplayResult) -> str:
    rows = []
    for series in result.innovations.values():
        for j, channel in enumerate(series.channels):
            r, s = series.residual[series.used, j], series.sigma[series.used, j]
            expected = float(np.nanmedian(s)) if np.isfinite(s).any() else float("nan")
            factor, unit = prefixed(expected, series.units[j])
            rms = float(np.sqrt(np.nanmean(r**2))) if np.isfinite(r).any() else float("nan")
            nis = significant(series.channel_nis.get(channel, float("nan")))
            rows.append([channel, significant(factor * rms), significant(factor * expected), unit, nis])
    table = text_table(["channel", "rms", "expected", "unit", "NIS"], rows, "<>><>")
    return f"Measured against predicted just before:\n{table}" if rows else ""


def _states(result: ReplayResult) -> str:
    """Median sigma of the states now and at the lag."""
    rows = []
    for i, name in enumerate(state_names(result.robot.layout)):
        now = float(np.median(result.states.sigma[:, i]))
        lagged = float(np.nanmedian(result.lagged.sigma[:, i])) if len(result.lagged.times) else float("nan")
        factor, unit = prefixed(now, state_unit(result.robot, name))
        rows.append([name, significant(factor * now), significant(factor * lagged), unit])
    return f"Sigma of the states, median:\n{text_table(['state', 'now', 'at the lag', 'unit'], rows, '<>><')}"


def _parameters(result: ReplayResult) -> str:
    rows = [
        [name, significant(rows[0, 0], 5), significant(rows[-1, 0], 5), significant(rows[-1, 1], 2)]
        for name, rows in result.states.parameters.items()
        if len(rows)
    ]
    return f"Adapted parameters:\n{text_table(['parameter', 'first', 'last', 'sigma'], rows, '<>>>')}" if rows else ""


def _events(result: ReplayResult) -> str:
    """How often what happened, and the first ones in words."""
    counts = ", ".join(f"{n} {kind.replace('_', ' ')}" for kind, n in result.event_counts.items())
    if not counts:
        return ""
    shown = [e for e in result.events if e.kind not in ("late", "duplicate")][:SHOWN_EVENTS]
    return "\n".join([f"Events: {counts}", *(f"  {e.time:9.3f} s  {e.text}" for e in shown)])
