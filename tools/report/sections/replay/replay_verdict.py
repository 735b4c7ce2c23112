# SPDX-License-Identifier: BSD-3-Clause
"""The answer to "can this estimate be trusted?" in words and numbers, and what to type next."""

from __future__ import annotations

from html import escape

from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.answer_box import Figures, judged_box
from jointscope.tools.report.page.page import Section
from jointscope.tools.verdicts.replay_judgement import diagnose_command, judge_replay, suspects


def replay_verdict(result: ReplayResult) -> Section:
    """Verdict box: headline, big numbers, checks; below it the command that follows from an alarm."""
    body = judged_box(judge_replay(result), _figures(result))
    off = suspects(result)
    if off:
        names = ", ".join(s.sensor for s in off)
        text = f"The residuals of {names} are larger than the model expects. Ask what is missing:"
        body += f'<p class="after">{escape(text)}</p><pre>{escape(diagnose_command(result))}</pre>'
    return Section("verdict", "Can this estimate be trusted?", body)


def _figures(result: ReplayResult) -> Figures:
    latency = result.latency
    speed = result.recording_seconds / result.wall_seconds if result.wall_seconds > 0.0 else float("nan")
    received = sum(result.status.received.values()) or result.messages
    return [
        (significant(result.nis_mean), "mean NIS per degree of freedom; 1 is expected"),
        (
            f"{significant(1e3 * latency.p50)} <small>ms</small>",
            f"per update in the median, {significant(1e3 * latency.p99)} ms in 99 of 100; {result.updates} updates",
        ),
        (f"{significant(speed, 2)}<small>×</small>", f"real time: {significant(result.wall_seconds)} s of work"),
        (f"{result.dropped}", f"of {received} messages left out"),
    ]
