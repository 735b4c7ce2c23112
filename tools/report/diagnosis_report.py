# SPDX-License-Identifier: BSD-3-Clause
"""The report of a diagnosis: whether the model lacks something, what, and why the recordings say so."""

from __future__ import annotations

from pathlib import Path

from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.tools.acceptance.evaluation import NO_LIMITS, AcceptedBy
from jointscope.tools.presentation.candidate_numbers import share_text
from jointscope.tools.presentation.compared_models import of_diagnosis
from jointscope.tools.presentation.model_answer import (
    base_unexplained_share,
    diagnosis_answer,
    judged_recording,
    of_verdict,
)
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.acceptance import acceptance
from jointscope.tools.report.page.answer_box import answer_box
from jointscope.tools.report.page.notices import notices
from jointscope.tools.report.page.page import Section, page
from jointscope.tools.report.page.provenance import provenance
from jointscope.tools.report.sections.comparison.horizon_curve import horizon_curve
from jointscope.tools.report.sections.comparison.worst_windows import worst_windows
from jointscope.tools.report.sections.diagnosis.channel_failures import channel_failures
from jointscope.tools.report.sections.diagnosis.failure_correlations import failure_correlations
from jointscope.tools.report.sections.diagnosis.next_commands import after_diagnosis
from jointscope.tools.report.sections.diagnosis.noise_levels import noise_levels
from jointscope.tools.report.sections.diagnosis.ranking import ranking
from jointscope.tools.report.sections.diagnosis.regimes import regimes
from jointscope.tools.report.sections.diagnosis.torque_maps import torque_maps
from jointscope.tools.report.sections.diagnosis.torque_over_time import torque_over_time
from jointscope.tools.report.sections.diagnosis.untestable import untestable


def diagnosis_report(result: Diagnosis, checked: AcceptedBy = NO_LIMITS) -> str:
    """The whole page as text.

    Args:
        result: what the diagnosis found.
        checked: limits that the user has declared, as they came out.

    Returns:
        HTML without references to anything outside of itself.
    """
    recordings = [*result.recordings, *([result.heldout] if result.heldout is not None else [])]
    seconds = sum(result.wall_seconds.values()) if result.wall_seconds else None
    sections = [
        _diagnosis_verdict(result),
        *acceptance(checked),
        ranking(result),
        channel_failures(result.failure),
        regimes(result.failure),
        failure_correlations(result.failure),
        *_predictions(result),
        torque_maps(result.missing),
        torque_over_time(result.missing),
        noise_levels(result),
        untestable(result),
        after_diagnosis(result),
        notices(recordings),
        provenance(recordings, [result.robot], seconds),
    ]
    names = ", ".join(Path(recording.path).name for recording in recordings)
    return page(f"Diagnosis of {result.robot.name}", f"{names} · {result.robot.description}", sections)


def _predictions(result: Diagnosis) -> list[Section]:
    compared = of_diagnosis(result)
    return [] if compared is None else [horizon_curve(compared), worst_windows(compared)]


def _diagnosis_verdict(result: Diagnosis) -> Section:
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
