# SPDX-License-Identifier: BSD-3-Clause
"""Combinations of parameters that the recording determines badly, in words and as bars."""

from __future__ import annotations

from html import escape

from jointscope.graphs.calibration.calibration_result import CalibrationResult, WeakDirection
from jointscope.tools.presentation.numbers import minus
from jointscope.tools.report.page.page import Section, sentence

LEFT, BAR = 190, 180  # [px] names, longest bar
LARGEST = 6


def weak_directions(result: CalibrationResult) -> Section:
    """One paragraph per direction."""
    lead = (
        "Parameters may trade against each other: along these directions the values can move together and "
        "the fit hardly changes. More varied motion, or a measured value for one of them, removes a direction."
    )
    if not result.weak_directions:
        return Section("weak", "Weak directions", "<p>There are none: every combination is well determined.</p>", lead)
    return Section("weak", "Weak directions", "".join(_direction(d) for d in result.weak_directions), lead)


def _direction(direction: WeakDirection) -> str:
    largest = sorted(direction.weights.items(), key=lambda item: -abs(item[1]))[:LARGEST]
    scale = max(abs(weight) for _, weight in largest) or 1.0
    rows = []
    for i, (name, weight) in enumerate(largest):
        y, length = 20 * i + 10, BAR * abs(weight) / scale
        rows.append(
            f'<text class="end" x="{LEFT - 10}" y="{y}">{escape(name)}</text>'
            f'<rect class="fill {"k0" if weight < 0 else "k2"}" x="{LEFT}" y="{y - 6}" '
            f'width="{length:.1f}" height="12"/>'
            f'<text class="name" x="{LEFT + length + 7:.1f}" y="{y}">{minus(f"{weight:+.2f}")}</text>'
        )
    height = 20 * len(largest)
    return (
        f'<h3>{escape(sentence(direction.text))}</h3><div class="scroll">'
        f'<svg width="{LEFT + BAR + 60}" height="{height}" viewBox="0 0 {LEFT + BAR + 60} {height}" '
        f'role="img" aria-label="weights of the direction">{"".join(rows)}</svg></div>'
    )
