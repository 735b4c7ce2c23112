# SPDX-License-Identifier: BSD-3-Clause
"""Whether the steps of a calibration are short enough for what the motion does between two samples."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.model.robot import SHARPNESS
from jointscope.tools.presentation.numbers import significant

MISSED = 1.0  # of the smallest random torque, which stands for what steps miss; arms that are right reach 0.7


def short_steps(result: CalibrationResult) -> tuple[str, str]:
    """Level and sentence."""
    if not result.step_errors:
        return "info", "Not asked here."
    layout = result.robot.layout
    i = int(np.argmax(result.step_errors))
    joint = [*layout.links, *layout.motors][i]
    if result.step_errors[i] < MISSED:
        return "good", "Between two states the motion is what the integration says."
    step = 1e3 * float(np.median(np.diff(result.bags[0].ticks)))
    return (
        "bad",
        f"Steps of {significant(step, 2)} ms miss {significant(result.step_errors[i], 2)} times what they may: "
        f"friction stops {joint} within a small part of one, so that its inertia, the smallest of its torques, is not "
        f"the one above. Where the real friction turns over more slowly, say how ({joint}.{SHARPNESS}); the inertia of "
        "so light a joint is better taken from a drawing (`fixed: true`).",
    )
