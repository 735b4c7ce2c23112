# SPDX-License-Identifier: BSD-3-Clause
"""The answer to "which effects did the model lack?" in words and numbers."""

from __future__ import annotations

from jointscope.graphs.discovery.diagnosis_words import there_but_small
from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.tools.presentation.candidate_numbers import share_text
from jointscope.tools.presentation.model_answer import changes, discovery_answer, judged_error, unexplained_share
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.answer_box import answer_box
from jointscope.tools.report.page.page import Section


def discovery_verdict(result: Discovery) -> Section:
    """Headline, big numbers, what every step means."""
    first, last = result.steps[0], result.steps[-1]
    judged = "held-out recording" if result.held_out else "training recordings"
    before, after = significant(judged_error(first)), significant(judged_error(last))
    arrow = f"{before} → {after}" if len(result.steps) > 1 else after
    figures = [
        (f"{arrow} <small>σ</small>", f"error {result.judged_by} on the {judged}"),
        (f"{significant(last.floor)} <small>σ</small>", "what noise and the uncertainty of the state alone would give"),
        (share_text(unexplained_share(last)), "of the squared error is still unexplained"),
        (str(len(changes(result))), f"effects changed, {len(result.steps)} models calibrated"),
    ]
    told = [step.paragraph for step in result.steps if step.paragraph]
    if last.diagnosis is not None and last.diagnosis.small:
        told.append(there_but_small(last.diagnosis.small))
    told.append(f"Stopped: {result.stop_reason}")
    return answer_box("verdict", "Which effects did the model lack?", discovery_answer(result), figures, told)
