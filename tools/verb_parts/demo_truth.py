# SPDX-License-Identifier: BSD-3-Clause
"""What a discovery found against the truth of the simulation: before, without the effect, and after."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.tools.presentation.numbers import percent, significant, with_sigma
from jointscope.tools.terminal.text_table import text_table

FALSE = "added, too, although the simulation does not have it"
ALLOWED_ERROR = 0.02  # a parameter within 2 % of the truth is called found


def against_truth(result: Discovery, truth: Mapping[str, Any], effects: Sequence[str]) -> str:
    """Table of true values, those of the base model and those of the last model, and two sentences."""
    first, last = result.steps[0].robot, result.robot
    rows, wrong_before, wrong_after = [], [], []
    for p in last.parameters.values():
        true = truth.get(p.name)
        if not isinstance(true, float) or true == 0.0 or p.fixed:
            continue
        sigma = math.nan if p.sigma is None else p.sigma
        error = abs(p.value / true - 1.0)
        before = first.parameters.get(p.name)
        if p.name.count(".") == 1 and before is not None:
            wrong_before.append(abs(before.value / true - 1.0))
            wrong_after.append(error)
        value, spread = with_sigma(p.value, sigma)
        distance = f"{abs(p.value - true) / sigma:.1f}" if sigma > 0.0 else "—"
        start = significant(before.value, 4) if before is not None else ""
        rows.append([p.name, significant(true, 4), start, value, spread, p.unit, percent(error), distance])
    head = ["parameter", "truth", "base model", "last model", "± sigma", "unit", "error", "in sigmas"]
    return f"{text_table(head, rows, '<>>>><>>')}\n\n{_verdict(result, effects, wrong_before, wrong_after)}"


def _verdict(result: Discovery, effects: Sequence[str], before: list[float], after: list[float]) -> str:
    added = [step.added for step in result.steps if step.added]
    hidden = [effect.partition(":")[0] for effect in effects]
    told = (
        _said([label for label in hidden if label in added], "found"),
        _said([label for label in hidden if label not in added], "NOT found"),
        _said([label for label in added if label not in hidden], FALSE),
    )
    found = "; ".join(filter(None, told))
    if not before:
        return f"{found}."
    good = sum(error <= ALLOWED_ERROR for error in after)
    return (
        f"{found}. Of {len(after)} parameters {good} are within {ALLOWED_ERROR:.0%} of the truth, the largest error is "
        f"{percent(max(after))}; without the effect{'s' if len(effects) > 1 else ''} it was {percent(max(before))}."
    )


def _said(labels: Sequence[str], what: str) -> str:
    return f"{', '.join(labels)} {'was' if len(labels) == 1 else 'were'} {what}" if labels else ""
