# SPDX-License-Identifier: BSD-3-Clause
"""A discovery on one screen: the answer, what every step means, the waterfall, the sizes that were found."""

from __future__ import annotations

from jointscope.graphs.discovery.diagnosis_words import there_but_small
from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.tools.presentation.candidate_numbers import effect_rows
from jointscope.tools.presentation.model_answer import discovery_answer, unexplained_share
from jointscope.tools.presentation.numbers import percent, significant
from jointscope.tools.terminal.diagnosis_text import ranking_text
from jointscope.tools.terminal.text_table import text_table


def discovery_text(result: Discovery) -> str:
    """The summary of a discovery for the terminal."""
    answer = discovery_answer(result)
    paragraphs = [f"  - {step.paragraph}" for step in result.steps if step.paragraph]
    parts = ["\n".join([answer.headline, answer.why, *paragraphs]), waterfall_text(result), _sizes(result)]
    last = result.steps[-1].diagnosis
    if last is not None and last.small:
        parts.append(there_but_small(last.small))
    if last is not None and not result.adequate:
        parts.append(ranking_text(last))
    parts.append(f"Stopped: {result.stop_reason}")
    return "\n\n".join(part for part in parts if part)


def waterfall_text(result: Discovery) -> str:
    """One row per step."""
    rows = [
        [
            str(k),
            step.label,
            significant(step.train_error),
            significant(step.heldout_error),
            significant(step.floor),
            percent(unexplained_share(step)),
            step.robot_file,
        ]
        for k, step in enumerate(result.steps)
    ]
    head = ["step", "change", "training", "held out", "floor", "unexplained", "robot file"]
    where = "on the training recordings (fitted to) and on the held-out recording"
    title = f"Error {result.judged_by} in sensor sigmas, {where}:"
    return f"{title}\n{text_table(head, rows, '><>>>><')}"


def _sizes(result: Discovery) -> str:
    """Parameters of the effects in the last model."""
    rows = effect_rows(result.robot)
    return (
        "Effects in the last model:\n" + text_table(["parameter", "value", "± sigma", "unit"], rows, "<>><")
        if rows
        else ""
    )
