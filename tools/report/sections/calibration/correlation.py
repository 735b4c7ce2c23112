# SPDX-License-Identifier: BSD-3-Clause
"""Correlations of all shared values as a triangular heat map with values under the pointer."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.tools.presentation.numbers import minus
from jointscope.tools.report.page.page import Section, figure, table

Array = NDArray[np.float64]

LEFT = 190  # [px] for the names of the rows
PRINTED = 0.3  # smaller correlations show their colour only
PAIRS = 8


def correlation(result: CalibrationResult) -> Section:
    """Heat map and the strongest pairs."""
    lead = (
        "How estimates move together, −1 to 1. Blue: when one is too large, so is the other; orange: the other is too "
        "small. Values near ±1 cannot be told apart well by this recording."
    )
    if not len(result.names):
        return Section("correlation", "Correlation", "<p>There is nothing to correlate.</p>", lead)
    body = '<div class="pair">' + figure([heat_map(result.names, result.correlation)]) + _strongest(result) + "</div>"
    return Section("correlation", "Correlation", body, lead)


def heat_map(names: Sequence[str], correlation: Array) -> str:
    """Lower triangle; names at the left, and along the diagonal where the upper triangle leaves room."""
    s = len(names)
    size = max(min(560 // s, 34), 12)
    top, width = 92, LEFT + s * size + 120
    parts = []
    for i, name in enumerate(names):
        y = top + i * size
        parts.append(f'<text class="end" x="{LEFT - 6}" y="{y + size / 2:.1f}">{escape(name)}</text>')
        x = LEFT + i * size + size / 2
        parts.append(
            f'<text x="{x:.1f}" y="{y - 5}" transform="rotate(-45 {x:.1f} {y - 5})">{escape(_short(name))}</text>'
        )
        parts += [_cell(names, correlation, i, j, size, top) for j in range(i + 1)]
    return (
        f'<svg viewBox="0 0 {width} {top + s * size + 6}" role="img" aria-label="correlation matrix">'
        f"{''.join(parts)}</svg>"
    )


def _cell(names: Sequence[str], correlation: Array, i: int, j: int, size: int, top: int) -> str:
    r = float(correlation[i, j])
    x, y = LEFT + j * size, top + i * size
    if i == j:
        return f'<rect class="faint soft" x="{x}" y="{y}" width="{size - 1}" height="{size - 1}"/>'
    tip = f"{names[i]} and {names[j]}: {minus(f'{r:+.3f}')}"
    printed = abs(r) >= PRINTED and size >= 20
    number = minus(f"{r:.1f}").replace("0.", ".")
    label = f'<text class="mid" x="{x + size / 2 - 0.5:.1f}" y="{y + size / 2:.1f}">{number}</text>' if printed else ""
    strong = " strong" if abs(r) >= 0.65 else ""
    return (
        f'<g class="cell {"k0" if r < 0 else "k2"}{strong}" data-tip="{escape(tip, quote=True)}">'
        f'<rect class="fill" fill-opacity="{0.04 + 0.96 * min(abs(r), 1.0):.2f}" x="{x}" y="{y}" '
        f'width="{size - 1}" height="{size - 1}"><title>{escape(tip)}</title></rect>{label}</g>'
    )


def _strongest(result: CalibrationResult) -> str:
    rows, columns = np.tril_indices(len(result.names), -1)
    values = result.correlation[rows, columns]
    order = np.argsort(-np.abs(values))[:PAIRS]
    cells = [
        [
            f"<code>{escape(result.names[rows[k]])}</code><br><code>{escape(result.names[columns[k]])}</code>",
            minus(f"{values[k]:+.3f}"),
        ]
        for k in order
    ]
    return f"<div>{table(['strongest pairs', 'correlation'], cells, [1])}</div>"


def _short(name: str) -> str:
    return name if len(name) <= 22 else f"{name[:20]}…"
