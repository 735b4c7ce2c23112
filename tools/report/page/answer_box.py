# SPDX-License-Identifier: BSD-3-Clause
"""The box at the top of a report: the answer in one sentence, big numbers, findings, and what was checked."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from jointscope.tools.presentation.model_answer import Answer
from jointscope.tools.report.page.page import Section, foldable, listed, sentence
from jointscope.tools.verdicts.judgement import Check, Judgement

SHOWN = 5  # more findings than these go below a fold
SIGNS = {"good": "✓", "info": "i", "warn": "!", "bad": "✕"}

Figures = Sequence[tuple[str, str]]
"""Big numbers (HTML) and what they are (plain text)."""


def answer_box(id_: str, title: str, answer: Answer, figures: Figures, told: Sequence[str]) -> Section:
    """The section.

    Args:
        id_: anchor.
        title: the question.
        answer: level, sentence and its numbers.
        figures: as it says.
        told: findings, plain text.
    """
    why = f'<p class="why">{escape(answer.why)}</p>'
    return Section(id_, title, _box(answer, f"{why}{_numbers(figures)}{_findings(told)}"))


def judged_box(judgement: Judgement, figures: Figures, told: Sequence[str] = ()) -> str:
    """The body of such a section, with every check that was made.

    Args:
        judgement: headline and checks.
        figures: as it says.
        told: findings, plain text.
    """
    checks = "".join(_check_line(check) for check in judgement.checks)
    return _box(judgement, f'{_numbers(figures)}{_findings(told)}<ul class="checks">{checks}</ul>')


def checks_listed(checks: Sequence[Check]) -> list[str]:
    """The same checks as plain items of a list."""
    return [f"<b>{escape(check.name)}</b>: {escape(check.text)}" for check in checks]


def _box(said: Answer | Judgement, body: str) -> str:
    return f'<div class="verdict {said.level}"><p class="answer">{escape(said.headline)}</p>{body}</div>'


def _numbers(figures: Figures) -> str:
    numbers = "".join(f"<div><b>{number}</b><span>{escape(text)}</span></div>" for number, text in figures)
    return f'<div class="figures">{numbers}</div>'


def _findings(told: Sequence[str]) -> str:
    items = [escape(sentence(text)) for text in told]
    findings = listed(items[:SHOWN], "findings") if items else ""
    if len(items) > SHOWN:
        findings += foldable(f"{len(items) - SHOWN} more findings", listed(items[SHOWN:], "findings"))
    return findings


def _check_line(check: Check) -> str:
    return (
        f'<li class="{check.level}"><i aria-label="{check.level}">{SIGNS[check.level]}</i>'
        f"<b>{escape(check.name)}</b><span>{escape(sentence(check.text))}</span></li>"
    )
