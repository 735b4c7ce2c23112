# SPDX-License-Identifier: BSD-3-Clause
"""Plots below each other on one axis, and curves in bands of their sigmas."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from jointscope.tools.report.page.plot import POINTS, Array, Axes, Band, Curve, Mark, plot

TICKS = 28  # [px] height of the ticks and the label of an axis


def below_each_other(panels: Sequence[tuple[Axes, Sequence[Mark]]]) -> list[str]:
    """Plots whose last one alone has ticks and the label of x, which come on top of its height."""
    last = len(panels) - 1
    with_ticks = [
        replace(axes, height=axes.height + TICKS) if k == last else replace(axes, x_label="")
        for k, (axes, _) in enumerate(panels)
    ]
    return [plot(axes, marks) for axes, (_, marks) in zip(with_ticks, panels, strict=True)]


def in_band(name: str, x: Array, y: Array, sigma: Array, colour: str, points: int = POINTS) -> list[Mark]:
    """A curve, and three sigmas on both sides of it."""
    half = 3.0 * sigma
    return [Band("±3 sigma", x, y - half, y + half, colour), Curve(name, x, y, colour, points=points)]
