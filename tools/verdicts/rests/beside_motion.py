# SPDX-License-Identifier: BSD-3-Clause
"""Whether rests in one estimate with other kinds agree with the model, as checks of that estimate."""

from __future__ import annotations

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.rests.rests_beside_motion import seen_rests
from jointscope.graphs.rests.seen_rests import SeenRests
from jointscope.tools.verdicts.rests.not_told import from_one_side, standing
from jointscope.tools.verdicts.rests.rest_verdict import contradiction

NAME, TOLD = "Rests that agree with the model", "Rests that tell what they might"


def rests_agree(result: CalibrationResult) -> list[tuple[str, str, str]]:
    """Level, name and sentence of each check; none without rests."""
    rests = seen_rests(result)
    return [] if rests is None else rest_checks(rests)


def rest_checks(rests: SeenRests) -> list[tuple[str, str, str]]:
    """Level, name and sentence of each check."""
    level, said = contradiction(rests)
    found = [(level, NAME, f"{said[:1].upper()}{said[1:]}." if said else "Links and motors rest where it says.")]
    if silent := standing(rests) or from_one_side(rests):
        found.append(("info", TOLD, f"Of the joints, {silent}."))
    return found
