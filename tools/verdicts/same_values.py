# SPDX-License-Identifier: BSD-3-Clause
"""Do other ways tell the same values: regression on the same recordings, frequency responses in the same estimate?"""

from __future__ import annotations

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult, ParameterEstimate
from jointscope.graphs.frequency.agreement import Agreement
from jointscope.graphs.joint_kinds.beside_motion import responses_agree
from jointscope.tools.presentation.numbers import significant

NAME = "Kinds that agree on the values"
BY_REGRESSION = "Regression says the same"
APART = (5.0, 0.03)  # [sigma of both ways together, share of the value], both, from which two ways disagree


def same_values(result: CalibrationResult) -> list[tuple[str, str, str]]:
    """Level, name and sentence of a check; none without frequency responses."""
    found = responses_agree(result)
    if found is None:
        return []
    said = test_said(found)
    if not found.doubtful:
        return [agreed(found, "Motion and frequency responses agree", "motion and frequency responses")]
    text = (
        f"Motion and frequency responses contradict each other: {said}. The model lacks an effect that one of them "
        "shows, the load was another, or the robot changed. `jointscope diagnose` with each alone says what it may be."
    )
    return [("bad", NAME, text)]


def agreed(test: Agreement, said: str, kinds: str) -> tuple[str, str, str]:
    """Level, name and sentence where kinds do not contradict each other; none is told of kinds with no value in common.

    Args:
        test: of the kinds.
        said: that they agree.
        kinds: their names.
    """
    if test.dof == 0:
        return "info", NAME, f"No value is told by both {kinds}: whether they agree cannot be tested."
    return "good", NAME, f"{said}: {test_said(test)}."


def test_said(test: Agreement) -> str:
    """How far apart two kinds of recordings are."""
    return f"chi-square {significant(test.chi2, 3)} for {test.dof} directions, p = {significant(test.p_value, 2)}"


def same_by_regression(result: CalibrationResult) -> tuple[str, str, str]:
    """Level, name and sentence: regression needs no states and no process noise; where both disagree one is wrong."""
    if not result.regressed:
        return "info", BY_REGRESSION, "Regression knows rigid joints with dry and viscous friction only."
    table = {p.name: p for p in result.parameters}
    apart = {n: _apart(table[n], other.value, other.sigma) for n, other in result.regressed.items() if n in table}
    worst = max(apart, key=lambda n: apart[n], default="")
    if not worst or apart[worst] <= APART[0]:
        text = f"So it does of {len(apart)} values, each within its uncertainty or a few percent."
        return "good", BY_REGRESSION, text
    found, other = table[worst], result.regressed[worst]
    text = (
        f"{worst} is {significant(found.value)} ± {significant(found.sigma, 1)} {found.unit} here and "
        f"{significant(other.value)} ± {significant(other.sigma, 1)} {found.unit} by regression on the same "
        f"recordings, {significant(apart[worst], 2)} sigma apart: one of the two is wrong."
    )
    return "warn", BY_REGRESSION, text


def _apart(found: ParameterEstimate, value: float, sigma: float) -> float:
    """Distance of two values of a parameter in their sigmas; zero where it is a small share of it."""
    distance = abs(found.value - value)
    if distance <= APART[1] * max(abs(found.value), abs(value)):
        return 0.0
    return float(distance / max(np.hypot(found.sigma, sigma), 1e-300))
