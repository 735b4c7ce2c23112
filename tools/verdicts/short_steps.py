# SPDX-License-Identifier: BSD-3-Clause
"""Whether the steps of a calibration are short enough for what the motion does between two samples."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.model.robot import SHARPNESS
from jointscope.tools.presentation.numbers import significant

SHIFTED = 0.01  # of an inertia: what is called right is right within a percent


def short_steps(result: CalibrationResult) -> tuple[str, str]:
    """Level and sentence."""
    shifts = result.inertia_shifts
    if shifts is None:
        return "info", "Not checked here."
    worst = max(shifts, key=lambda name: abs(shifts[name]), default="")
    if not worst or abs(shifts[worst]) < SHIFTED:
        return "good", "Between two states the motion is as the integration has it."
    step = 1e3 * float(np.median(np.diff(result.bags[0].ticks)))
    joint = worst.rsplit(".", 1)[0]
    return (
        "bad",
        f"What steps of {significant(step, 2)} ms miss looks like {significant(100 * shifts[worst], 2)} "
        f"% of {worst}: friction stops so light a joint within a small part of a step. If the real friction reverses "
        f"more slowly, say so ({joint}.{SHARPNESS}); otherwise take such an inertia from a drawing (`fixed: true`).",
    )
