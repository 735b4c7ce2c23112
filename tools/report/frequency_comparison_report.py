# SPDX-License-Identifier: BSD-3-Clause
"""The report of models on frequency responses: tables of errors, and each entry measured and predicted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from jointscope.graphs.frequency.compare_frequency import FrequencyErrors
from jointscope.tools.acceptance.evaluation import NO_LIMITS, AcceptedBy
from jointscope.tools.report.page.acceptance import acceptance
from jointscope.tools.report.page.page import Key, Section, figure, page, text_cells
from jointscope.tools.report.page.plot import Axes, Curve, Mark, measured_with_band, plot
from jointscope.tools.report.sections.comparison.model_colours import model_colour
from jointscope.tools.terminal.responses_text import BALANCE_HEAD, ERROR_HEAD, balance_rows, error_rows


def frequency_comparison_report(
    by_label: Mapping[str, Sequence[FrequencyErrors]], checked: AcceptedBy = NO_LIMITS
) -> str:
    """The whole page as text, without references to anything outside of itself.

    Args:
        by_label: poses by name of the model.
        checked: limits that the user has declared, as they came out.
    """
    first = next(iter(by_label.values()))
    paths = ", ".join(each.pose.path for each in first)
    sections = [
        Section("errors", "How far off", text_cells(ERROR_HEAD, error_rows(by_label), (3, 4, 5)), ERRORS),
        Section("balance", "What the torques show", text_cells(BALANCE_HEAD, balance_rows(by_label), (3, 4)), LEFT),
        *acceptance(checked),
        *(_pose(by_label, k) for k in range(len(first))),
    ]
    return page("Models on frequency responses", paths, sections)


ERRORS = (
    "Root mean square over lines and poses: size of the model's entry over the measured one, the floor that the "
    "covariance of the measured one alone would give, and the distance in its sigmas (floor: 1). The model's matrix "
    "has viscous friction in place of dry friction, as a sine sees it."
)
LEFT = (
    "What the torque balance leaves of each motor's torque, with dry friction as it is, and its power over that of the "
    "noise from period to period."
)


def _pose(by_label: Mapping[str, Sequence[FrequencyErrors]], k: int) -> Section:
    """Every entry of a pose, measured and of each model, and the distance in sigmas below it."""
    each = {label: poses[k] for label, poses in by_label.items()}
    first, panels = next(iter(each.values())), []
    pose, square, f = first.pose, first.pose.w**2, np.asarray(first.pose.w / (2.0 * np.pi))
    for i, output in enumerate(pose.matrix.outputs):
        for j, source in enumerate(pose.matrix.inputs):
            marks = measured_with_band(f, square * np.abs(first.measured[:, i, j]), square * first.spread[:, i, j])
            far: list[Mark] = []
            for number, (label, one) in enumerate(each.items()):
                marks.append(Curve(label, f, square * np.abs(one.model[:, i, j]), model_colour(number)))
                far.append(Curve(label, f, one.sigmas[:, i, j], model_colour(number)))
            axes = Axes(f"{source} to {output} [rad/s^2/(N m)]", "frequency [Hz]", 510, 220, log_x=True, log_y=True)
            panels.append(plot(axes, marks))
            panels.append(
                plot(
                    Axes(f"{source} to {output}: error [sigma]", "frequency [Hz]", 510, 160, log_x=True, log_y=True),
                    far,
                )
            )
    keys = [Key("measured", "k0"), Key("two sigmas", "k0", "band")]
    keys += [Key(label, model_colour(number)) for number, label in enumerate(each)]
    lead = (
        "From the torque of a motor to the acceleration of another, and how far the models are from it, line by line."
    )
    return Section(f"bode{k}", f"Response in {pose.path}", figure(panels, keys), lead)
