# SPDX-License-Identifier: BSD-3-Clause
"""The box at the top of a report: the answer in one sentence, big numbers, findings."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from jointscope.tools.presentation.model_answer import Answer
from jointscope.tools.report.page.page import Section, foldable, sentence

SHOWN = 5  # more findings than these go below a fold


def answer_box(
    id_: str, title: str, answer: Answer, figures: Sequence[tuple[str, str]], told: Sequence[str]
) -> Section:
    """The section.

    Args:
        id_: anchor.
        title: the question.
        answer: level, sentence and its numbers.
        figures: big numbers (HTML) and what they are (plain text).
        told: findings, plain text.
    """
    numbers = "".join(f"<div><b>{number}</b><span>{escape(text)}</span></div>" for number, text in figures)
    lines = [f"<li>{escape(sentence(text))}</li>" for text in told]
    findings = f'<ul class="findings">{"".join(lines[:SHOWN])}</ul>' if lines else ""
    if len(lines) > SHOWN:
        rest = f'<ul class="findings">{"".join(lines[SHOWN:])}</ul>'
        findings += foldable(f"{len(lines) - SHOWN} more findings", rest)
    body = (
        f'<div class="verdict {answer.level}"><p class="answer">{escape(answer.headline)}</p>'
        f'<p class="why">{escape(answer.why)}</p><div class="figures">{numbers}</div>{findings}</div>'
    )
    return Section(id_, title, body)
