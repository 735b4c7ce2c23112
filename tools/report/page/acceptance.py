# SPDX-License-Identifier: BSD-3-Clause
"""The limits that a user has declared, as a section of the report."""

from __future__ import annotations

from html import escape

from jointscope.tools.acceptance.evaluation import AcceptedBy
from jointscope.tools.report.page.page import Section, table
from jointscope.tools.terminal.acceptance_text import acceptance_answer


def acceptance(checked: AcceptedBy) -> list[Section]:
    """One section with a table for each model, by its label; none where no limits were given."""
    if not checked:
        return []
    head = ["outcome", "name", "limit", "found", "because"]
    body = ""
    for label, lines in checked.items():
        rows = [
            [escape(text) for text in (line.outcome, line.name, line.limit.text, line.found, line.limit.reason)]
            for line in lines
        ]
        title = f"<h3>{escape(label)}</h3>" if len(checked) > 1 else ""
        body += f"{title}<p>{escape(acceptance_answer(lines))}</p>{table(head, rows, [])}"
    return [Section("acceptance", "Limits", body)]
