# SPDX-License-Identifier: BSD-3-Clause
"""What these recordings cannot show, and which motion would show it."""

from __future__ import annotations

from html import escape

from jointscope.graphs.discovery.diagnosis_result import Candidate, Diagnosis
from jointscope.tools.presentation.model_answer import excitation_of, look_alike_reasons, of_verdict
from jointscope.tools.report.page.page import Section, foldable, sentence, table

SHOWN = 8


def untestable(result: Diagnosis) -> Section:
    """Untestable candidates, then pairs that look alike."""
    lead = (
        "Not testable is not absent: were the effect there in a typical size, it would not show in this motion. "
        "Effects that look alike here need another motion to be told apart."
    )
    weak = of_verdict(result, "untestable")
    parts = [_weak(weak)] if weak else ["<p>Every candidate could have shown itself in these recordings.</p>"]
    alike = [c for c in result.candidates if c.look_alikes and c.verdict in ("missing", "possible")]
    if alike:
        parts.append("<h3>Effects that look alike here</h3>" + _alike(alike))
    return Section("untestable", "What these recordings cannot show", "".join(parts), lead)


def _weak(candidates: list[Candidate]) -> str:
    rows = [
        [
            f"<code>{escape(c.label)}</code>",
            escape(" ".join(map(sentence, c.reasons))) or "—",
            escape(sentence(excitation_of(c.effect))) if excitation_of(c.effect) else "—",
        ]
        for c in candidates
    ]
    head = ["effect", "why not", "motion that would show it"]
    rest = foldable(f"{len(rows) - SHOWN} more", table(head, rows[SHOWN:])) if rows[SHOWN:] else ""
    return table(head, rows[:SHOWN]) + rest


def _alike(candidates: list[Candidate]) -> str:
    rows = []
    for c in candidates:
        known = look_alike_reasons(c.effect)
        for label in c.look_alikes:
            other = label.split("@")[0]
            why = known.get(other, "their regressors correlate above 0.95 in these recordings")
            motions = [text for text in (excitation_of(c.effect), excitation_of(other)) if text]
            rows.append(
                [
                    f"<code>{escape(c.label)}</code>",
                    f"<code>{escape(label)}</code>",
                    escape(sentence(why)),
                    "<br>".join(escape(sentence(text)) for text in dict.fromkeys(motions)) or "—",
                ]
            )
    return table(["effect", "looks like", "why", "motion that shows the one or the other"], rows)
