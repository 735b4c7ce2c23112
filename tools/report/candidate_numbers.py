# SPDX-License-Identifier: BSD-3-Clause
"""The numbers of a candidate as text, the same on the screen, in the report and in the viewer."""

from __future__ import annotations

import math

from jointscope.graphs.diagnosis_result import Candidate
from jointscope.tools.report.numbers import percent, significant, with_sigma

SMALLEST_P = 1e-12  # smaller ones mean nothing: no noise is so well known
VERDICT_LEVELS = {"missing": "bad", "possible": "warn", "absent": "good", "untestable": "info"}
NOTHING = "—"


def p_text(p: float) -> str:
    """A probability."""
    if not math.isfinite(p):
        return NOTHING
    return "< 10⁻¹²" if p < SMALLEST_P else significant(p, 2)


def share_text(share: float) -> str:
    """A share that may be missing or negative; less than a thousandth is nothing."""
    if not math.isfinite(share):
        return NOTHING
    return percent(share) if abs(share) >= 1e-3 else "0 %"


def parameter_texts(candidate: Candidate) -> list[tuple[str, str, str, str]]:
    """Name, value, sigma and unit of every parameter."""
    rows = []
    for name, p in candidate.parameters.items():
        value, sigma = with_sigma(p.value, p.sigma)
        rows.append((name, value, sigma, "" if p.unit == "1" else p.unit))
    return rows


def origin_text(candidate: Candidate) -> str:
    """Where the values come from."""
    return "refit" if candidate.refitted else "one linear step"
