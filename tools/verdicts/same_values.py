# SPDX-License-Identifier: BSD-3-Clause
"""Do frequency responses tell the same values as the motion in the same estimate?"""

from __future__ import annotations

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.joint_kinds.beside_motion import responses_agree
from jointscope.tools.presentation.numbers import significant

NAME = "Kinds that tell the same values"


def same_values(result: CalibrationResult) -> list[tuple[str, str, str]]:
    """Level, name and sentence of a check; none without frequency responses."""
    found = responses_agree(result)
    if found is None:
        return []
    said = f"chi-square {significant(found.chi2, 3)} for {found.dof} directions, p = {significant(found.p_value, 2)}"
    if not found.doubtful:
        return [("good", NAME, f"Motion and frequency responses agree: {said}.")]
    text = (
        f"Motion and frequency responses contradict each other: {said}. The model lacks an effect that one of them "
        "shows, the load was another, or the robot changed. `jointscope diagnose` with each alone says what it may be."
    )
    return [("bad", NAME, text)]
