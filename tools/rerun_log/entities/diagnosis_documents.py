# SPDX-License-Identifier: BSD-3-Clause
"""What a diagnosis and a discovery say, as markdown for the viewer."""

from __future__ import annotations

import math
from collections.abc import Sequence

from jointscope.graphs.discovery.diagnosis_result import Candidate, Diagnosis
from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.tools.presentation.candidate_numbers import NOTHING, evidence_texts, parameter_texts, share_text
from jointscope.tools.presentation.model_answer import (
    diagnosis_answer,
    discovery_answer,
    enumerated,
    of_verdict,
    unexplained_share,
)
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.page import sentence

TOLD = 10  # candidates whose reasons are told although they are absent


def diagnosis_markdown(result: Diagnosis) -> str:
    """The answer, the findings, and where the model fails."""
    answer = diagnosis_answer(result)
    lines = [f"# {answer.headline}", "", answer.why, "", *(f"- {sentence(text)}" for text in result.paragraphs)]
    if result.failure.sentences:
        lines += ["", "## Where the model fails", "", *(f"- {sentence(text)}" for text in result.failure.sentences)]
    rows = [
        [name, f"{significant(c.error)} σ", "" if math.isnan(c.autocorrelation) else f"{c.autocorrelation:+.2f}"]
        for name, c in result.failure.channels.items()
    ]
    lines += ["", *_table(["channel", "error 0.1 s ahead", "one-step autocorrelation"], rows)]
    untestable = [c.label for c in of_verdict(result, "untestable")]
    if untestable:
        lines += ["", f"Not testable with these recordings: {enumerated(untestable)}."]
    return "\n".join(lines)


def ranking_markdown(result: Diagnosis) -> str:
    """The ranking as a table and the reasons below it."""
    head = ["", "effect", "verdict", "score", "dof", "p", "explains", "left out [σ]", "held out [σ]", "size"]
    lines = ["# What may be missing", "", *_table(head, [_row(k + 1, c) for k, c in enumerate(result.candidates)])]
    told = [c for c in result.candidates if c.reasons and (c.verdict != "absent" or c in result.candidates[:TOLD])]
    for candidate in told:
        lines += ["", f"**{candidate.label}**, {candidate.verdict}{_numerics(candidate)}:"]
        lines += ["", *(f"- {sentence(text)}" for text in candidate.reasons)]
        if candidate.look_alikes:
            lines.append(f"- Looks like {enumerated(candidate.look_alikes, 'or')} in these recordings.")
    return "\n".join(lines)


def discovery_markdown(result: Discovery) -> str:
    """The answer, the waterfall as a table, and what every step means."""
    answer = discovery_answer(result)
    rows = [
        [
            str(k),
            step.label,
            significant(step.train_error),
            significant(step.heldout_error),
            significant(step.floor),
            share_text(unexplained_share(step)),
        ]
        for k, step in enumerate(result.steps)
    ]
    head = ["step", "change", "training [σ]", "held out [σ]", "floor [σ]", "unexplained"]
    lines = [f"# {answer.headline}", "", answer.why, "", *_table(head, rows), ""]
    lines += [f"- {sentence(step.paragraph)}" for step in result.steps if step.paragraph]
    lines += ["", f"Stopped: {sentence(result.stop_reason)}"]
    return "\n".join(lines)


def _row(rank: int, c: Candidate) -> list[str]:
    sizes = [f"{name} = {value} ± {sigma} {unit}".strip() for name, value, sigma, unit in parameter_texts(c)]
    return [
        str(rank),
        c.label,
        (f"**{c.verdict}**" if c.verdict in ("missing", "possible") else c.verdict) + _numerics(c),
        *evidence_texts(c),
        ", ".join(sizes) or NOTHING,
    ]


def _numerics(c: Candidate) -> str:
    return " (numerics)" if c.numerics else ""


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a markdown table."""
    lines = [list(head), ["---"] * len(head), *rows]
    return ["| " + " | ".join(cell.replace("|", "/") for cell in line) + " |" for line in lines]
