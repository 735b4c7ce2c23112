# SPDX-License-Identifier: BSD-3-Clause
"""Whether the ranking depends on the process noise: the first candidates at several noise levels."""

from __future__ import annotations

from html import escape

from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.tools.report.page.page import Section, table


def noise_levels(result: Diagnosis) -> Section:
    """One row per level."""
    lead = (
        "Noise that was fitted beside an incomplete model swallows part of what is missing. A candidate that is first "
        "at every level does not owe its place to the noise."
    )
    if not result.noise_levels:
        return Section(
            "levels", "Does the noise decide?", "<p>The ranking was computed at one noise level only.</p>", lead
        )
    most = max(len(labels) for labels in result.noise_levels.values())
    first = [labels[0] for labels in result.noise_levels.values() if labels]
    rows = [
        [f"{level:g} times", *(_label(label, first) for label in labels), *[""] * (most - len(labels))]
        for level, labels in sorted(result.noise_levels.items())
    ]
    same = len(set(first)) == 1
    said = (
        f"{first[0]} is first at all {len(first)} levels."
        if same
        else "The first place changes with the noise: take the ranking with care."
    )
    head = ["process noise", *(f"{k + 1}" for k in range(most))]
    return Section("levels", "Does the noise decide?", f"<p>{escape(said)}</p>{table(head, rows)}", lead)


def _label(label: str, first: list[str]) -> str:
    best = ' class="best"' if label == first[0] else ""
    return f"<code{best}>{escape(label)}</code>"
