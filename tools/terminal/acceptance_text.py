# SPDX-License-Identifier: BSD-3-Clause
"""Limits that a user has declared, line by line, and the answer in one sentence."""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.tools.acceptance.evaluation import FAIL, OPEN, AcceptedBy, Checked
from jointscope.tools.terminal.text_table import text_table


def acceptance_answer(checked: Sequence[Checked]) -> str:
    """Accepted, not accepted or undecided, and by how many limits."""
    count = {outcome: sum(line.outcome == outcome for line in checked) for outcome in (FAIL, OPEN)}
    if count[FAIL]:
        return f"Not accepted: {count[FAIL]} of {len(checked)} limits failed."
    if count[OPEN]:
        return f"Undecided: {count[OPEN]} of {len(checked)} limits could not be evaluated; none failed."
    return f"Accepted: {f'all {len(checked)} limits are' if len(checked) > 1 else 'the limit is'} met."


def acceptance_text(checked: AcceptedBy) -> str:
    """The lines of each model and its answer.

    Args:
        checked: by the label of a model; with one model its label is not shown.
    """
    parts = []
    for label, lines in checked.items():
        rows = [[line.outcome, line.name, line.limit.text, line.found, line.limit.reason] for line in lines]
        table = text_table(["", "name", "limit", "found", "because"], rows, "<<<<<")
        parts.append(f"{f'{label}: ' if len(checked) > 1 else ''}{acceptance_answer(lines)}\n{table}")
    return "\n\n".join(parts)
