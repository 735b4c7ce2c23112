# SPDX-License-Identifier: BSD-3-Clause
"""The answer to "does the model lack something?" in words and numbers."""

from __future__ import annotations

from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.tools.presentation.candidate_numbers import share_text
from jointscope.tools.presentation.model_answer import (
    base_unexplained_share,
    diagnosis_answer,
    judged_recording,
    of_verdict,
)
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.answer_box import answer_box
from jointscope.tools.report.page.page import Section


def diagnosis_verdict(result: Diagnosis) -> Section:
    """Headline, big numbers, findings."""
    missing, untestable = of_verdict(result, "missing"), of_verdict(result, "untestable")
    sigma = "<small>σ</small>"
    figures = [
        (f"{significant(result.error)} {sigma}", f"error {result.judged_by} on the {judged_recording(result)}"),
        (f"{significant(result.floor)} {sigma}", "what sensor noise and the uncertainty of the state alone would give"),
        (share_text(base_unexplained_share(result)), "of the squared error is unexplained"),
        (str(len(result.candidates)), f"effects tried: {len(missing)} missing, {len(untestable)} not testable here"),
    ]
    return answer_box("verdict", "Does the model lack something?", diagnosis_answer(result), figures, result.paragraphs)
