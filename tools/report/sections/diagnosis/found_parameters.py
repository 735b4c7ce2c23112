# SPDX-License-Identifier: BSD-3-Clause
"""The effects in the last model with their sizes, and what adding them did to the other parameters."""

from __future__ import annotations

import math
from html import escape

from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.robots.parts.parameter import Parameter
from jointscope.tools.presentation.candidate_numbers import effect_rows, parameter_texts
from jointscope.tools.presentation.model_answer import enumerated
from jointscope.tools.presentation.numbers import minus, with_sigma
from jointscope.tools.report.page.page import Section, foldable, table


def found_parameters(result: Discovery) -> Section:
    """Sizes first; the other parameters before and after fold."""
    first, last = result.steps[0].robot, result.robot
    rows = [
        [f"<code>{escape(name)}</code>", f"<b>{value}</b>", sigma, escape(unit)]
        for name, value, sigma, unit in effect_rows(last)
    ]
    body = table(["parameter", "value", "± sigma", "unit"], rows, [1, 2]) if rows else _from_ranking(result)
    shared = [name for name in last.parameters if name in first.parameters and not last.parameters[name].fixed]
    if len(result.steps) > 1 and shared:
        pairs = [(first.parameters[name], last.parameters[name]) for name in shared]
        moved = [
            [f"<code>{escape(a.name)}</code>", *_value(a), *_value(b), escape(_unit(a)), _change(a, b)]
            for a, b in pairs
        ]
        title = ["parameter", "base model", "± sigma", "last model", "± sigma", "unit", "change"]
        body += foldable("what became of the other parameters", table(title, moved, [1, 2, 3, 4, 6]))
    lead = "The sizes of the effects that were added, calibrated together with everything else."
    return Section("found", "What was found", body, lead)


def _from_ranking(result: Discovery) -> str:
    """Where the last robot has no effect of its own: the sizes of what was added, as the diagnosis saw them."""
    added = list(dict.fromkeys(step.added for step in result.steps if step.added))
    seen = {c.label: c for step in result.steps if step.diagnosis for c in step.diagnosis.candidates}
    rows = [
        [f"<code>{escape(label)}</code>", escape(name), value, sigma, escape(unit)]
        for label in added
        if label in seen
        for name, value, sigma, unit in parameter_texts(seen[label])
    ]
    if not rows:
        return f"<p>{escape(enumerated(added))}: without a size.</p>" if added else "<p>No effect was added.</p>"
    return table(["effect", "parameter", "value", "± sigma", "unit"], rows, [2, 3])


def _value(p: Parameter) -> tuple[str, str]:
    return with_sigma(p.value, p.sigma if p.sigma is not None else math.nan)


def _unit(p: Parameter) -> str:
    return "" if p.unit == "1" else p.unit


def _change(a: Parameter, b: Parameter) -> str:
    return minus(f"{100.0 * (b.value / a.value - 1.0):+.1f} %") if a.value else "—"
