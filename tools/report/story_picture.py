# SPDX-License-Identifier: BSD-3-Clause
"""A discovery in one picture: the error of every step, and the worst moment of the base model before and after."""

from __future__ import annotations

from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.tools.presentation.compared_models import of_discovery
from jointscope.tools.report.page.picture import picture
from jointscope.tools.report.page.stacked import stacked
from jointscope.tools.report.sections.comparison.worst_windows import window_keys, window_plots
from jointscope.tools.report.sections.diagnosis.waterfall import LEFT, RIGHT, waterfall_picture

BAR = 440  # [px] longest bar; the picture is as wide as a page on a code host
STEPS = "The model learns what it lacks: error 0.1 s ahead, step by step"
WINDOW = "Where the base model was worst, before and after"


def story_picture(result: Discovery) -> str:
    """An SVG file.

    Args:
        result: what the discovery found.
    """
    compared = of_discovery(result)
    parts = [stacked([waterfall_picture(result, BAR)], title=STEPS)]
    for window in compared.models[0].worst[:1]:
        plots = window_plots(compared, window, LEFT + BAR + RIGHT)
        parts.append(stacked(plots, window_keys(compared), WINDOW))
    return picture(stacked(parts, spoken=f"{STEPS}; {WINDOW[0].lower()}{WINDOW[1:]}"))
