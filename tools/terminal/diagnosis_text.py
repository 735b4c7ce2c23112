# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis on one screen: the answer, findings, the ranking with its evidence, sizes, what to do next."""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.graphs.discovery.diagnosis_result import Candidate, Diagnosis
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.tools.presentation.candidate_numbers import evidence_texts, origin_text, parameter_texts
from jointscope.tools.presentation.model_answer import diagnosis_answer, missing_numerics, of_verdict
from jointscope.tools.presentation.numbers import percent, significant
from jointscope.tools.terminal.text_table import text_table

SHOWN = 10  # candidates; the report has them all
SHOWN_PARAGRAPHS = 4
SHOWN_SIZES = 4


def diagnosis_text(result: Diagnosis) -> str:
    """The summary of a diagnosis for the terminal."""
    answer = diagnosis_answer(result)
    paragraphs = [f"  - {text}" for text in result.paragraphs[:SHOWN_PARAGRAPHS]]
    head = "\n".join([answer.headline, answer.why, *paragraphs])
    parts = [
        head,
        _where(result),
        ranking_text(result),
        sizes_text(leaders(result)),
        _untestable(result),
        _next(result),
    ]
    return "\n\n".join(part for part in parts if part)


def leaders(result: Diagnosis) -> list[Candidate]:
    """Candidates whose size matters: missing or possible ones that have one."""
    return [c for c in result.candidates if c.verdict in ("missing", "possible") and c.parameters][:SHOWN_SIZES]


def ranking_text(result: Diagnosis) -> str:
    """The ranking as a table."""
    if not result.candidates:
        return "No effect of the catalogue can act on this robot."
    rows = [_row(k + 1, candidate) for k, candidate in enumerate(result.candidates[:SHOWN])]
    head = ["", "effect@owner", "verdict", "score", "dof", "p", "explains", "validation", "held out", "looks like"]
    lines = [
        "Ranking of what may be missing (errors in sensor sigmas; p corrected for the number of candidates):",
        text_table(head, rows, "><<>>>>>><"),
    ]
    if len(result.candidates) > SHOWN:
        lines.append(f"  and {len(result.candidates) - SHOWN} more in the report")
    lines.append(
        f"  base model: {significant(result.validation_error)} on the validation blocks, to which it was also fitted; "
        f"largest score of meaningless regressors {significant(result.placebo_score)} per degree of freedom"
    )
    return "\n".join(lines)


def _row(rank: int, c: Candidate) -> list[str]:
    return [
        str(rank),
        c.label,
        f"{c.verdict} (numerics)" if c.numerics else c.verdict,
        *evidence_texts(c),
        ", ".join(c.look_alikes),
    ]


def sizes_text(candidates: Sequence[Candidate]) -> str:
    """Parameter values of the leaders as a table."""
    rows = []
    for candidate in candidates:
        for k, (name, value, sigma, unit) in enumerate(parameter_texts(candidate)):
            rows.append([candidate.label if k == 0 else "", name, value, sigma, unit, origin_text(candidate)])
    if not rows:
        return ""
    return "Sizes:\n" + text_table(["effect@owner", "parameter", "value", "± sigma", "unit", "from"], rows, "<<>><<")


def _where(result: Diagnosis) -> str:
    sentences = result.failure.sentences[:3]
    return "\n".join(["Where the model fails:", *(f"  - {text}" for text in sentences)]) if sentences else ""


def _untestable(result: Diagnosis) -> str:
    labels = [c.label for c in of_verdict(result, "untestable")]
    if not labels:
        return ""
    shown = ", ".join(labels[:SHOWN]) + (f" and {len(labels) - SHOWN} more" if len(labels) > SHOWN else "")
    return f"Not testable with these recordings, so neither missing nor absent: {shown}"


def _next(result: Diagnosis) -> str:
    missing = of_verdict(result, "missing") or missing_numerics(result)
    if result.adequate or not missing:
        return ""
    share = missing[0].share
    effect = f" (it explains {percent(share)} of the excess error)" if share > 0.0 else ""
    output = edited_argument(result.robot, missing[0].effect)
    return f"Next: jointscope add {robot_argument(result.robot)} {missing[0].label} -o {output}{effect}"
