# SPDX-License-Identifier: BSD-3-Clause
"""Sections that repeat for every recording: the first is open, the others fold."""

from __future__ import annotations

from collections.abc import Callable

from jointscope.graphs.calibration.calibration_result import BagFit, CalibrationResult
from jointscope.tools.presentation.sensor_signals import bag_name
from jointscope.tools.report.page.page import foldable


def per_bag(result: CalibrationResult, draw: Callable[[BagFit, str], str]) -> str:
    """Calls `draw(bag, zoom_group)` for every recording."""
    parts = [draw(bag, f"bag{i}") for i, bag in enumerate(result.bags)]
    if len(parts) <= 1:
        return "".join(parts)
    return parts[0] + "".join(
        foldable(f"recording {bag_name(bag, i)}", part)
        for i, (bag, part) in enumerate(zip(result.bags, parts, strict=True))
        if i > 0
    )
