# SPDX-License-Identifier: BSD-3-Clause
"""A robot with free links on one screen: what was added and why, the waterfall of each equation, what was refused."""

from __future__ import annotations

from jointscope.graphs.transmission.regression import total
from jointscope.graphs.transmission.transmission_model import physical
from jointscope.graphs.transmission.transmission_result import TransmissionDiscovery
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.terminal.text_table import text_table

MILLI = 1e3


def transmission_text(result: TransmissionDiscovery) -> str:
    """The summary for the terminal."""
    steps = result.steps
    head = (
        f"{steps[0].model.robot.name}: motors, links and gyros compared without equations of motion "
        "(link_dynamics: free)"
    )
    paragraphs = [f"  - {step.paragraph}" for step in steps]
    parts = ["\n".join([head, *paragraphs]), waterfall_text(result), _sizes(result), _refused(result)]
    if len(steps) > 1 or result.refused:
        parts.append(f"Stopped: {result.stop_reason}.")
    return "\n\n".join(part for part in parts if part)


def waterfall_text(result: TransmissionDiscovery) -> str:
    """One row per equation, one column per step; held out where there is such a recording."""
    units = result.units()
    held_out = result.holdout is not None
    rows = []
    for name, (sigma, unit) in units.items():
        found = [(step.heldout if held_out else step.train)[name] * sigma * MILLI for step in result.steps]
        rows.append([name, f"m{unit}", *(f"{value:.3g}" for value in found)])
    errors = [total(dict(step.heldout if held_out else step.train)) for step in result.steps]
    rows.append(["all", "sigma", *map(significant, errors)])
    numbers = [str(k) for k in range(len(result.steps))]
    where = "the held-out recording" if held_out else "the training recordings"
    legend = "\n".join(f"  {k}: {step.added or 'as the robot file has it'}" for k, step in enumerate(result.steps))
    table = text_table(["equation", "unit", *numbers], rows, "<<" + ">" * len(numbers))
    title = f"What each step leaves unexplained on {where} (rms; zeros and biases are the recording's own):"
    return f"{title}\n{table}\n{legend}"


def size_rows(result: TransmissionDiscovery) -> list[list[str]]:
    """Name, value, standard deviation, unit of every size."""
    robot = result.robot
    rows = []
    for candidate in result.model.chosen:
        for name in candidate.sizes:
            parameter = robot.parameters[name]
            sigma = significant(parameter.sigma) if parameter.sigma is not None else ""
            rows.append([name, significant(physical(result.model, name)), sigma, parameter.unit])
    return rows


def _sizes(result: TransmissionDiscovery) -> str:
    rows = size_rows(result)
    if not rows:
        return ""
    return "Sizes, with the spread over blocks of the recordings:\n" + text_table(
        ["parameter", "value", "± sigma", "unit"], rows, "<>><"
    )


def _refused(result: TransmissionDiscovery) -> str:
    rows = [[label, why] for label, why in result.refused.items() if "would" in why]
    return "Looked at and refused:\n" + text_table(["effect", "why"], rows, "<<") if rows else ""
