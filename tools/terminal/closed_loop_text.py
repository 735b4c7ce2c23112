# SPDX-License-Identifier: BSD-3-Clause
"""Closed loops on one screen: errors of the links and the head, what came after the hits, effort, what was known."""

from __future__ import annotations

from jointscope.tools.closed_loop.closed_loop_result import CONTROLLERS, SOURCES, ClosedLoopResult, LoopRun
from jointscope.tools.presentation.numbers import percent, significant
from jointscope.tools.simulator.effects_of_file import not_simulated, not_simulated_text
from jointscope.tools.terminal.text_table import text_table

HEAD = [
    *("controller", "source", "E_rms rad", "link mrad", "rad/s", "head mm", "at hit mm", "at hit m/s"),
    *("overshoot mrad", "settled s", "effort", "chatter", "saturated"),
]
KNOWN_HEAD = ["controller", "source", "q_link mrad", "v_link rad/s", "q_motor mrad", "v_motor rad/s"]


def closed_loop_text(result: ClosedLoopResult) -> str:
    """The summary for the terminal."""
    truth, plan = result.truth, result.plan
    effects = ", ".join(f"{e['effect']}@{e['owner']}" for e in truth["effects"]) or "none"
    left = not_simulated_text(not_simulated(result.robot, truth))
    parts = [
        f"{truth['robot']}, seed {truth['seed']}: {plan.count} in {truth['seconds']:g} s; "
        f"hidden effects: {effects}; controllers know {result.model_told}" + (f"\n{left}" if left else ""),
        "Errors against the plan (rms), and what it cost (shares of the full command):\n"
        + text_table(HEAD, [_tracking(run) for run in result.runs], "<<" + ">" * (len(HEAD) - 2)),
    ]
    known = [_known(run) for run in result.runs if run.source != "true"]
    if known:
        table = text_table(KNOWN_HEAD, known, "<<" + ">" * (len(KNOWN_HEAD) - 2))
        parts.append(f"What the controllers knew against the true state (rms):\n{table}")
    accounts = [run.estimator for run in result.runs if run.estimator is not None]
    if accounts:
        p50, p99 = (max(account.update_ms[name] for account in accounts) for name in ("p50", "p99"))
        alarms = ", ".join(sorted({channel for account in accounts for channel in account.alarms})) or "none"
        parts.append(f"One tick of the estimator: median {p50:.2f} ms, 99th percentile {p99:.2f} ms; alarms: {alarms}")
    return "\n\n".join(parts)


def _tracking(run: LoopRun) -> list[str]:
    t = run.tracking
    settled = "never" if t.settling is None else f"{t.settling:.2f}"
    return [
        *(CONTROLLERS[run.controller], SOURCES[run.source]),
        *(significant(t.e_rms), significant(1e3 * t.link_position_rms), significant(t.link_velocity_rms)),
        *(significant(1e3 * t.head_position), significant(1e3 * t.hit_position), significant(t.hit_velocity)),
        *(significant(1e3 * t.overshoot), settled),
        *(f"{t.effort:.3f}", f"{t.chatter:.4f}", percent(t.saturated)),
    ]


def _known(run: LoopRun) -> list[str]:
    e = run.tracking.estimation
    numbers = (1e3 * e["q_link"], e["v_link"], 1e3 * e["q_motor"], e["v_motor"])
    return [CONTROLLERS[run.controller], SOURCES[run.source], *map(significant, numbers)]
