# SPDX-License-Identifier: BSD-3-Clause
"""The answer to "is this calibration good?" in words and numbers."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.parts.relative_sigma import relative_sigma
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.answer_box import Figures, judged_box
from jointscope.tools.report.page.page import Section
from jointscope.tools.verdicts.judgement import judge, largest_relative_sigma


def verdict(result: CalibrationResult) -> Section:
    """Verdict box: headline, big numbers, findings of the calibration, checks."""
    return Section("verdict", "Is this calibration good?", judged_box(judge(result), _figures(result), result.findings))


def _figures(result: CalibrationResult) -> Figures:
    name, share = largest_relative_sigma(result)
    chi2 = [fit.chi2 for fit in result.channels.values()]
    costs = [record.cost for record in result.iterations if record.stage == result.iterations[-1].stage]
    start = f"cost {significant(costs[0])} → {significant(costs[-1])} in {len(costs)} steps" if costs else ""
    return [
        (significant(float(np.mean(chi2))) if chi2 else "—", "mean χ² per sample over all channels; 1 is expected"),
        (relative_sigma(share, "±") if name else "—", f"least certain dynamic parameter: {name}"),
        (f"{result.samples:,}".replace(",", " "), f"samples in {significant(result.recording_seconds)} s of recording"),
        (f"{significant(result.wall_seconds)} <small>s</small>", f"to calibrate; {start}"),
    ]
