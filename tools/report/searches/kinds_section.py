# SPDX-License-Identifier: BSD-3-Clause
"""What several kinds of recordings say together, at the head of the report of a diagnosis."""

from __future__ import annotations

from html import escape

from jointscope.graphs.across_kinds.diagnose_kinds import KindsDiagnosis
from jointscope.tools.report.page.page import Section, table
from jointscope.tools.terminal.searches.kinds_text import HEAD, kinds_headline, kinds_rows, kinds_sentences


def kinds_section(found: KindsDiagnosis) -> Section:
    """The ranking over all kinds; what follows is of the motion alone."""
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in kinds_sentences(found))
    rows = [[escape(cell) for cell in row] for row in kinds_rows(found)]
    lead = f"{kinds_headline(found)} The sections below are of the motion alone."
    return Section("all-kinds", "What all kinds say", f"<ul>{items}</ul>{table(HEAD, rows, ())}", lead)
