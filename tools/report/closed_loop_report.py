# SPDX-License-Identifier: BSD-3-Clause
"""The report of closed loops: tracking errors of controllers and state sources side by side."""

from __future__ import annotations

from jointscope.tools.closed_loop.closed_loop_result import ClosedLoopResult
from jointscope.tools.report.page.page import page
from jointscope.tools.report.page.provenance import provenance
from jointscope.tools.report.sections.closed_loop.loop_answer import loop_answer
from jointscope.tools.report.sections.closed_loop.loop_errors import loop_commands, loop_errors, loop_hits
from jointscope.tools.report.sections.closed_loop.loop_knowledge import loop_knowledge
from jointscope.tools.report.sections.closed_loop.loop_scores import loop_scores
from jointscope.tools.report.sections.closed_loop.loop_setup import loop_setup


def closed_loop_report(result: ClosedLoopResult) -> str:
    """The whole page as text.

    Args:
        result: all runs.

    Returns:
        HTML without references to anything outside of itself.
    """
    sections = [
        loop_answer(result),
        loop_scores(result),
        loop_hits(result),
        loop_errors(result),
        loop_knowledge(result),
        loop_commands(result),
        loop_setup(result),
        provenance([], [result.model]),
    ]
    truth = result.truth
    subtitle = f"simulated truth, seed {truth['seed']}, {truth['seconds']:g} s · {result.robot.description}"
    return page(
        f"Closed loop: {result.robot.name} {'hits balls' if result.hits_balls else 'follows a plan'}",
        subtitle,
        sections,
    )
