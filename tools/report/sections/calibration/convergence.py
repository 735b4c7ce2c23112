# SPDX-License-Identifier: BSD-3-Clause
"""How the solver came down: cost per iteration on a logarithmic axis, and the length of its steps."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.page import Key, Section, figure
from jointscope.tools.report.page.plot import Axes, Curve, plot

ENOUGH = 0.1  # [sigma] a step below this changes nothing that matters


def convergence(result: CalibrationResult) -> Section:
    """Two panels over the number of iterations, one colour per stage."""
    records = result.iterations
    if not records:
        return Section("convergence", "Convergence", "<p>The solver kept no history.</p>")
    stages = list(dict.fromkeys(record.stage for record in records))
    cost, step = [], []
    for k, stage in enumerate(stages):
        of_stage = [i for i, record in enumerate(records) if record.stage == stage]
        x = np.array(of_stage, dtype=float) + 1.0
        values = np.array([max(records[i].cost, 1e-12) for i in of_stage])
        lengths = np.array([max(records[i].step_in_sigmas, 1e-6) for i in of_stage])
        colour = f"k{(2, 0, 1, 3, 4, 5)[k % 6]}"
        cost += [Curve(stage, x, values, colour), *_dots(x, values, colour)]
        step += [Curve(stage, x, lengths, colour), *_dots(x, lengths, colour)]
    limits = (0.5, len(records) + 0.5)
    panels = [
        plot(Axes("cost, half the sum of squared residuals", "", height=200, x_range=limits, log_y=True), cost),
        plot(
            Axes(
                "largest step of a parameter [sigma]",
                "iteration",
                height=210,
                x_range=limits,
                log_y=True,
                levels=[(ENOUGH, "a tenth of a sigma")],
                level_at_left=True,
            ),
            step,
        ),
    ]
    keys = [Key(stage, f"k{(2, 0, 1, 3, 4, 5)[k % 6]}") for k, stage in enumerate(stages)]
    caption = f"Final cost {significant(result.cost, 4)} with {result.samples} samples."
    lead = "The cost must level out and the steps must shrink. Costs of different stages count different residuals."
    return Section("convergence", "Convergence", figure(panels, keys, caption), lead)


def _dots(x: np.ndarray, y: np.ndarray, colour: str) -> list[Curve]:
    """A dot per iteration: a line of no length with round ends."""
    return [Curve("", x[i : i + 1], y[i : i + 1], colour, "dots") for i in range(len(x))]
