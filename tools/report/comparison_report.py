# SPDX-License-Identifier: BSD-3-Clause
"""The report of a comparison: how well models predict a recording, where and when they fail."""

from __future__ import annotations

from pathlib import Path

from jointscope.graphs.comparison.comparison_result import ComparisonResult
from jointscope.tools.acceptance.evaluation import NO_LIMITS, AcceptedBy
from jointscope.tools.report.page.acceptance import acceptance
from jointscope.tools.report.page.notices import notices
from jointscope.tools.report.page.page import page
from jointscope.tools.report.page.provenance import provenance
from jointscope.tools.report.sections.comparison.horizon_curve import horizon_curve
from jointscope.tools.report.sections.comparison.horizon_table import horizon_table
from jointscope.tools.report.sections.comparison.model_scores import model_scores
from jointscope.tools.report.sections.comparison.predictions import predictions
from jointscope.tools.report.sections.comparison.worst_windows import worst_windows


def comparison_report(result: ComparisonResult, checked: AcceptedBy = NO_LIMITS) -> str:
    """The whole page as text.

    Args:
        result: what the comparison found.
        checked: limits that the user has declared, as they came out.

    Returns:
        HTML without references to anything outside of itself.
    """
    sections = [
        model_scores(result),
        *acceptance(checked),
        horizon_curve(result),
        predictions(result),
        worst_windows(result),
        horizon_table(result),
        notices([result.recording]),
        provenance([result.recording], [model.robot for model in result.models]),
    ]
    labels = " and ".join(model.label for model in result.models)
    name = Path(result.recording.path).name or result.recording.path
    return page(f"{labels} against {name}", result.recording.path, sections)
