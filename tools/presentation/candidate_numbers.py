# SPDX-License-Identifier: BSD-3-Clause
"""The numbers of a candidate as text, the same on the screen, in the report and in the viewer."""

from __future__ import annotations

import math

from jointscope.graphs.discovery.diagnosis_result import Candidate
from jointscope.robots.model.robot import Robot
from jointscope.tools.presentation.numbers import percent, significant, with_sigma

SMALLEST_P = 1e-12  # smaller ones mean nothing: no noise is so well known
VERDICT_LEVELS = {"missing": "bad", "possible": "warn", "absent": "good", "untestable": "info", "stand_in": "warn"}
NOTHING = "—"

STIFFNESS_UNITS = {"rad/(N m)": "N m/rad", "m/N": "N/m"}  # of a compliance, and of its inverse

Row = tuple[str, str, str, str]  # name, value, sigma, unit


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


def evidence_texts(c: Candidate) -> list[str]:
    """Score with its dof, p, the share that is explained, errors on blocks left out and on the held-out recording."""
    errors = significant(c.validation_error), significant(c.heldout_error)
    return [significant(c.score), str(c.dof), p_text(c.p_value), share_text(c.share), *errors]


def parameter_texts(candidate: Candidate) -> list[Row]:
    """Name, value, sigma and unit of every parameter; a stiffness beside its compliance."""
    rows = [row for name, p in candidate.parameters.items() for row in value_rows(name, p.value, p.sigma, p.unit)]
    return rows


def effect_rows(robot: Robot) -> list[Row]:
    """The same of all effects in a robot, by full name."""
    return [
        row
        for p in robot.parameters.values()
        if p.effect is not None
        for row in value_rows(p.name, p.value, math.nan if p.sigma is None else p.sigma, p.unit)
    ]


def value_rows(name: str, value: float, sigma: float, unit: str) -> list[Row]:
    """One row; for a compliance a second one with the stiffness, which is what people know."""
    rows = [(name, *with_sigma(value, sigma), "" if unit == "1" else unit)]
    if unit in STIFFNESS_UNITS and "compliance" in name and value > 0.0:
        stiffness = with_sigma(1.0 / value, sigma / value**2)
        rows.append((name.replace("compliance", "stiffness"), *stiffness, STIFFNESS_UNITS[unit]))
    return rows


def origin_text(candidate: Candidate) -> str:
    """Where the values come from."""
    return "refit" if candidate.refitted else "one linear step"
