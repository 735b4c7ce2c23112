# SPDX-License-Identifier: BSD-3-Clause
"""The report of a replay: one page that says first whether the estimate can be trusted."""

from __future__ import annotations

from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult
from jointscope.tools.report.page.page import page
from jointscope.tools.report.page.provenance import provenance
from jointscope.tools.report.sections.replay.batch_agreement import agreement
from jointscope.tools.report.sections.replay.correlation_over_time import correlation_over_time
from jointscope.tools.report.sections.replay.events import events, messages
from jointscope.tools.report.sections.replay.innovations import innovations
from jointscope.tools.report.sections.replay.latency import latency
from jointscope.tools.report.sections.replay.nis import nis
from jointscope.tools.report.sections.replay.replay_states import replay_states
from jointscope.tools.report.sections.replay.replay_verdict import replay_verdict


def replay_report(result: ReplayResult) -> str:
    """The whole page as text.

    Args:
        result: what the replay gave.

    Returns:
        HTML without references to anything outside of itself.
    """
    sections = [
        replay_verdict(result),
        nis(result),
        innovations(result),
        replay_states(result),
        correlation_over_time(result),
        agreement(result),
        latency(result),
        messages(result),
        events(result),
        provenance([result.source], [result.robot], result.wall_seconds),
    ]
    subtitle = f"{result.source.path or 'recording'} · lag {result.lag:g} s · {result.robot.description}"
    if result.stride > 1:
        subtitle += f" · every {result.stride}th tick is drawn"
    return page(f"Replay of {result.robot.name}", subtitle, sections)
