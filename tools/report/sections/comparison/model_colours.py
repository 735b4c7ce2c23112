# SPDX-License-Identifier: BSD-3-Clause
"""One colour per model, the same in every section."""

from __future__ import annotations

from jointscope.graphs.comparison.comparison_result import ComparisonResult
from jointscope.tools.report.page.page import Key

COUNT = 6


def model_colour(index: int) -> str:
    """Colour class of a model."""
    return f"m{index % COUNT}"


def model_keys(result: ComparisonResult) -> list[Key]:
    """Legend entries of all models."""
    return [Key(model.label, model_colour(i)) for i, model in enumerate(result.models)]
