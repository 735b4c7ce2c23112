# SPDX-License-Identifier: BSD-3-Clause
"""The report of frequency responses: Bode grid with bands, distortions by kind of line, resonances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointscope.graphs.responses.distortions import Distortions, Levels
from jointscope.graphs.responses.measured_response import MeasuredResponse
from jointscope.tools.presentation.noisy_response import buried_lines
from jointscope.tools.report.page.page import Key, Section, figure, page, text_cells
from jointscope.tools.report.page.plot import Axes, Curve, Mark, measured_with_band, plot
from jointscope.tools.terminal.responses_text import RESONANCE_HEAD, entry_rows, resonance_rows


def responses_report(found: Sequence[MeasuredResponse]) -> str:
    """The whole page as text, without references to anything outside of itself."""
    sections = [section for k, one in enumerate(found) for section in _sections(one, f"{k}" if k else "")]
    return page("Frequency responses", ", ".join(one.spectra.path for one in found), sections)


def _sections(found: MeasuredResponse, suffix: str) -> list[Section]:
    matrix, name = found.matrix, f" ({found.spectra.path})" if suffix else ""
    lead = (
        "Sigma in per cent of each entry, the median over lines. Noise: what changes from period to period. Total: "
        f"with the distortions, from {matrix.total_from}. {buried_lines(found)}"
    )
    made = [
        Section(
            f"entries{suffix}",
            f"How well it is known{name}",
            text_cells(["from", "to", "noise", "total"], entry_rows(matrix), (2, 3)),
            lead,
        ),
        bode_grid(found, f"bode{suffix}", f"Response{name}"),
    ]
    if found.distortions is not None:
        made.append(_distortions(found, found.distortions, f"distortions{suffix}", f"Distortions{name}"))
    if found.resonances:
        peaks = text_cells(RESONANCE_HEAD, resonance_rows(found), range(3, 7))
        made.append(Section(f"peaks{suffix}", f"Resonances{name}", peaks, PEAKS))
    return made


PEAKS = "Peaks (poles) and dips (zeros) of the entries that stand out from the scatter of their lines."


def bode_grid(found: MeasuredResponse, id: str, title: str) -> Section:
    """Size and phase of every entry with the band of its total covariance."""
    m, panels = found.matrix, []
    total, noise = m.sigmas(m.total), None if m.noise is None else m.sigmas(m.noise)
    for i, output in enumerate(m.outputs):
        for j, source in enumerate(m.inputs):
            size = np.abs(m.G[:, i, j])
            marks = measured_with_band(m.frequencies, size, total[:, i, j], "two sigmas, total")
            marks.append(Curve("sigma, total", m.frequencies, total[:, i, j], "k1", "hair"))
            if noise is not None:
                marks.append(Curve("sigma, noise", m.frequencies, noise[:, i, j], "k2", "hair"))
            panels.append(
                plot(Axes(f"{source} to {output}: size", "frequency [Hz]", 510, 220, log_x=True, log_y=True), marks)
            )
            phase = np.rad2deg(np.unwrap(np.angle(m.G[:, i, j])))
            axes = Axes(f"{source} to {output}: phase [deg]", "frequency [Hz]", 510, 160, log_x=True)
            panels.append(plot(axes, [Curve("measured", m.frequencies, phase, "k0")]))
    keys = [
        Key("measured", "k0"),
        Key("two sigmas, total", "k0", "band"),
        Key("sigma, total", "k1"),
        Key("sigma, noise", "k2"),
    ]
    lead = "Where sigma comes near the size, the entry is not known. Total above noise: the system is not linear."
    return Section(id, title, figure(panels, keys), lead)


def _distortions(found: MeasuredResponse, d: Distortions, id: str, title: str) -> Section:
    panels = []
    kinds: list[tuple[str, Levels | None, str]] = [
        ("excited lines", d.excited, "k0"),
        ("even lines", d.even, "k1"),
        ("odd lines", d.odd, "k2"),
        ("noise", d.noise, "k3"),
    ]
    there = [(name, levels, colour) for name, levels, colour in kinds if levels is not None and len(levels.frequencies)]
    for i, output in enumerate(found.matrix.outputs):
        marks: list[Mark] = []
        for name, levels, colour in there:
            size = np.maximum(levels.size[:, i], 1e-6 * d.excited.size[:, i].max())
            marks.append(Curve(name, levels.frequencies, size, colour, "dots" if name != "noise" else "hair"))
        panels.append(plot(Axes(f"{output}: amplitude", "frequency [Hz]", height=240, log_x=True, log_y=True), marks))
    lead = (
        "What the output holds on lines that were not excited, beside those that were: even lines show distortions of "
        "even order, odd ones of odd order."
    )
    if found.spectra.common is not None:
        lead += " Both signs are subtracted: of even distortions only what goes with a common motion is left."
    if not len(d.even.frequencies):
        lead += " Here all lines were excited: leave some out to see distortions."
    return Section(id, title, figure(panels, [Key(name, colour) for name, _, colour in there]), lead)
