# SPDX-License-Identifier: BSD-3-Clause
"""The report of effects that were found from rests: the steps, the ranking, then the last model."""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.graphs.rest_search.discover_rests import RestDiscovery
from jointscope.tools.report.page.page import Section, page, text_cells
from jointscope.tools.report.rests_report import rest_sections
from jointscope.tools.terminal.searches.rest_search_text import headline, ranking_table, step_table, untestable_said


def rest_search_report(found: RestDiscovery, more: Sequence[Section] = ()) -> str:
    """The whole page as text, without references to anything outside of itself.

    Args:
        found: a diagnosis, or all steps of a discovery.
        more: sections at the end.
    """
    first, *others = rest_sections(found.steps[-1].result)
    paths = ", ".join(rests.path for rests in found.recordings)
    title = f"{found.robot.name}: what is missing, from rests"
    return page(title, paths, [first, _steps(found), _ranking(found), *others, *more])


def _steps(found: RestDiscovery) -> Section:
    """The waterfall: what each effect that was added is worth."""
    head, rows = step_table(found)
    lead = (
        "How far links rest from where motors and loads put them, in the sigmas of the last model, and the torque that "
        "is missing for equilibrium of each joint, rms."
    )
    if found.stop_reason:
        lead += f" The search ended because {found.stop_reason}."
    return Section("steps", "What was missing", text_cells(head, rows, range(2, len(head))), lead)


def _ranking(found: RestDiscovery) -> Section:
    """What the last model may lack."""
    head, rows = ranking_table([c for c in found.candidates if c.verdict != "untestable"])
    lead = " ".join([headline(found), *untestable_said(found.candidates)])
    return Section("ranking", "What may be missing still", text_cells(head, rows, range(2, 7)), lead)
