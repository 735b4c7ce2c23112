# SPDX-License-Identifier: BSD-3-Clause
"""The report of a robot with free links: findings, the waterfall, the sizes, and each equation before and after."""

from __future__ import annotations

from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.transmission.transmission_result import TransmissionDiscovery
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.page import Key, Section, figure, page, sentence, table
from jointscope.tools.report.page.plot import Axes, Curve, plot

MILLI = 1e3
AXES = "xyz"
HOLE = 6.0  # mean sampling periods from which a pause is drawn as one

Array = NDArray[np.float64]


def transmission_report(result: TransmissionDiscovery) -> str:
    """The whole page as text, without references to anything outside of itself."""
    recordings = [*result.recordings, *([result.holdout] if result.holdout is not None else [])]
    names = ", ".join(dict.fromkeys(Path(recording.path).name for recording in recordings))
    robot = result.steps[0].model.robot
    sections = [_findings(result), _waterfall(result), _sizes(result), _pictures(result), _refused(result)]
    return page(f"{robot.name}: motors against links", names, sections)


def _findings(result: TransmissionDiscovery) -> Section:
    items = "".join(f"<li>{escape(sentence(step.paragraph))}</li>" for step in result.steps)
    lead = "Masses are not known; only what motors, links and gyros say about each other is modelled."
    return Section("findings", "Findings", f"<ul>{items}</ul><p>{escape(sentence(result.stop_reason))}</p>", lead)


def _waterfall(result: TransmissionDiscovery) -> Section:
    units, held_out = result.units(), result.holdout is not None
    rows = []
    for k, step in enumerate(result.steps):
        errors = step.heldout if held_out else step.train
        rows.append(
            [str(k), escape(step.added or "base model"), *(_milli(errors[n] * s) for n, (s, _) in units.items())]
        )
    head = ["step", "added", *(f"{name} [m{unit}]" for name, (_, unit) in units.items())]
    where = "held-out recording, which chose nothing" if held_out else "training recordings"
    lead = f"Rms of what is left of each equation on the {where}; zeros and biases are the recording's own."
    return Section("waterfall", "Waterfall", table(head, rows, range(2, len(head))), lead)


def _sizes(result: TransmissionDiscovery) -> Section:
    from jointscope.tools.terminal.transmission_text import size_rows

    rows = [[escape(cell) for cell in row] for row in size_rows(result)]
    lead = "Standard deviations are the spread over blocks of the recordings that were left out one by one."
    return Section("sizes", "Sizes", table(["parameter", "value", "± sigma", "unit"], rows, [1, 2]), lead)


def _pictures(result: TransmissionDiscovery) -> Section:
    recording = result.holdout if result.holdout is not None else result.recordings[0]
    figures = []
    for name, (_, unit) in result.units().items():
        equation, _, before = result.steps[0].model.left(recording, name)
        after = result.model.left(recording, name)[2]
        shown = int(np.argmax(np.std(before, axis=0)))
        axis = f", {AXES[shown]}" if before.shape[1] > 1 else ""
        other = result.model.left(recording, name)[0].times
        curves = [
            Curve("base model", *_broken(equation.times, MILLI * before[:, shown]), "k0"),
            Curve("last model", *_broken(other, MILLI * after[:, shown]), "k1"),
        ]
        keys = [Key("base model", "k0"), Key("last model", "k1")]
        figures.append(figure([plot(Axes(f"{name}{axis}: left over [m{unit}]"), curves)], keys, group="time"))
    return Section("pictures", "Before and after", "".join(figures), f"On {Path(recording.path).name}.")


def _broken(times: Array, values: Array) -> tuple[Array, Array]:
    """The curve with a hole where samples are missing, in which a line would claim to know something."""
    gaps = np.flatnonzero(np.diff(times) > HOLE * np.mean(np.diff(times))) + 1
    return np.insert(times, gaps, times[gaps - 1]), np.insert(values, gaps, np.nan)


def _refused(result: TransmissionDiscovery) -> Section:
    rows = [[escape(label), escape(sentence(why))] for label, why in result.refused.items()]
    return Section("refused", "Looked at and refused", table(["effect", "why"], rows))


def _milli(value: float) -> str:
    return significant(MILLI * value)
