# SPDX-License-Identifier: BSD-3-Clause
"""Whether the steps of a calibration are short enough for what the motion does between two samples."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.model.robot import SHARPNESS
from jointscope.tools.presentation.numbers import significant

MISSED = 0.1  # of the random torques; light joints of which inertias were 3 % and more off: 0.15, others 0.005


def short_steps(result: CalibrationResult) -> tuple[str, str]:
    """Level and sentence."""
    if not result.step_errors:
        return "info", "Not checked here."
    layout = result.robot.layout
    i = int(np.argmax(result.step_errors))
    joint = [*layout.links, *layout.motors][i]
    if result.step_errors[i] < MISSED:
        return "good", "Between two states the motion is as the integration has it."
    step = 1e3 * float(np.median(np.diff(result.bags[0].ticks)))
    return (
        "bad",
        f"Steps of {significant(step, 2)} ms miss {significant(100 * result.step_errors[i], 2)} % of the random "
        f"torques: friction stops joints as light as {joint} within a small part of a step, so the inertias of light "
        f"joints are biased. If the real friction reverses more slowly, say so ({joint}.{SHARPNESS}); otherwise take "
        "such an inertia from a drawing (`fixed: true`).",
    )
