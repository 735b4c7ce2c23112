# SPDX-License-Identifier: BSD-3-Clause
"""The report of a diagnosis: whether the model lacks something, what, and why the recordings say so."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.tools.acceptance.evaluation import NO_LIMITS, AcceptedBy
from jointscope.tools.presentation.compared_models import of_diagnosis
from jointscope.tools.report.page.acceptance import acceptance
from jointscope.tools.report.page.notices import notices
from jointscope.tools.report.page.page import Section, page
from jointscope.tools.report.page.provenance import provenance
from jointscope.tools.report.sections.comparison.horizon_curve import horizon_curve
from jointscope.tools.report.sections.comparison.worst_windows import worst_windows
from jointscope.tools.report.sections.diagnosis.channel_failures import channel_failures
from jointscope.tools.report.sections.diagnosis.diagnosis_verdict import diagnosis_verdict
from jointscope.tools.report.sections.diagnosis.failure_correlations import failure_correlations
from jointscope.tools.report.sections.diagnosis.next_commands import after_diagnosis
from jointscope.tools.report.sections.diagnosis.noise_levels import noise_levels
from jointscope.tools.report.sections.diagnosis.ranking import ranking
from jointscope.tools.report.sections.diagnosis.regimes import regimes
from jointscope.tools.report.sections.diagnosis.torque_maps import torque_maps
from jointscope.tools.report.sections.diagnosis.torque_over_time import torque_over_time
from jointscope.tools.report.sections.diagnosis.untestable import untestable


def diagnosis_report(result: Diagnosis, checked: AcceptedBy = NO_LIMITS, first: Sequence[Section] = ()) -> str:
    """The whole page as text.

    Args:
        result: what the diagnosis found.
        checked: limits that the user has declared, as they came out.
        first: sections before all others.

    Returns:
        HTML without references to anything outside of itself.
    """
    recordings = [*result.recordings, *([result.heldout] if result.heldout is not None else [])]
    seconds = sum(result.wall_seconds.values()) if result.wall_seconds else None
    sections = [
        *first,
        diagnosis_verdict(result),
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
