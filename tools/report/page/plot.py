# SPDX-License-Identifier: BSD-3-Clause
"""One set of axes with curves, bands, bars and dots as an inline SVG.

The curves live in an inner SVG with its own coordinates (a tenth of a pixel, whole numbers), so that the page's
script can zoom by changing one viewBox while text and strokes keep their size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.report.page.scale import Scale, padded, padded_log

Array = NDArray[np.float64]

UNITS_PER_PIXEL = 10
BAND_POINTS = 400
PIXELS_PER_TICK = {"x": 90, "y": 30}
SIGMAS = 2.0  # half width of bands
SMALLEST = 1e-3  # of a curve: the lower end of a band on a logarithmic axis
POINTS = 1500  # about one and a half per pixel of a wide plot


@dataclass(frozen=True)
class Curve:
    """A line; `colour` is a class of the style sheet, `style` one of solid, dashed, wide, hair, dots."""

    name: str
    x: Array
    y: Array
    colour: str = "k0"
    style: str = "solid"
    points: int = POINTS


@dataclass(frozen=True)
class Band:
    """The area between two curves."""

    name: str
    x: Array
    low: Array
    high: Array
    colour: str = "k0"


@dataclass(frozen=True)
class Bars:
    """Bars from zero (from the lower limit on a logarithmic axis) that fill the space between edges."""

    name: str
    edges: Array
    heights: Array
    colour: str = "k0"


Mark = Curve | Band | Bars


def measured_with_band(x: Array, size: Array, sigma: Array, name: str = "two sigmas") -> list[Mark]:
    """A measured curve in the band of its uncertainty, whose lower end stays above zero for a logarithmic axis."""
    low, high = np.maximum(size - SIGMAS * sigma, SMALLEST * size), size + SIGMAS * sigma
    return [Band(name, x, low, high, "k0"), Curve("measured", x, size, "k0")]


@dataclass(frozen=True)
class Axes:
    """What surrounds the curves.

    Attributes:
        title: what is shown and its unit, above the plot.
        x_label: text below the ticks; "" hides ticks and label of the x axis (stacked panels).
        width, height: of the whole picture [px].
        x_range, y_range: limits; None: from the data.
        log_x, log_y: logarithmic axes.
        levels: horizontal guide lines: value and text.
        level_at_left: where the texts of the guide lines stand.
        shade: stretch of x to emphasise.
        zoomable: whether the page's script may zoom and read values.
    """

    title: str
    x_label: str = "time [s]"
    width: int = 1040
    height: int = 190
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    log_x: bool = False
    log_y: bool = False
    levels: Sequence[tuple[float, str]] = field(default_factory=tuple)
    level_at_left: bool = False
    shade: tuple[float, float] | None = None
    zoomable: bool = True


def plot(axes: Axes, marks: Sequence[Mark]) -> str:
    """The picture as text.

    Args:
        axes: what surrounds the curves.
        marks: drawn in this order.

    Returns:
        An SVG element without outside references.
    """
    left, top, right, bottom = 58, 24, 10, 38 if axes.x_label else 10
    inner_width, inner_height = axes.width - left - right, axes.height - top - bottom
    x_scale = _scale(axes.x_range, [_extent_x(m) for m in marks], inner_width, axes.log_x, flip=False, air=0.0)
    y_extents = [_extent_y(m, x_scale) for m in marks] + [(v, v) for v, _ in axes.levels]
    y_scale = _scale(axes.y_range, y_extents, inner_height, axes.log_y, flip=True, air=0.06)
    grid = _grid(axes, x_scale, y_scale, inner_width, inner_height)
    width, height = inner_width * UNITS_PER_PIXEL, inner_height * UNITS_PER_PIXEL
    drawn = _shade(axes, x_scale, height) + "".join(_draw(m, x_scale, y_scale, height) for m in marks)
    zoom = (
        f' data-x="{x_scale.low:.9g},{x_scale.high:.9g}" data-y="{y_scale.low:.9g},{y_scale.high:.9g}"'
        f' data-log="{int(axes.log_x)},{int(axes.log_y)}"'
        if axes.zoomable
        else ""
    )
    return (
        f'<svg class="plot" viewBox="0 0 {axes.width} {axes.height}" role="img" '
        f'aria-label="{escape(axes.title)}"{zoom}>'
        f'<text class="title" x="{left}" y="14">{escape(axes.title)}</text>'
        f'<g transform="translate({left} {top})">{grid}'
        f'<svg class="data" width="{inner_width}" height="{inner_height}" viewBox="0 0 {width} {height}" '
        f'preserveAspectRatio="none">{drawn}</svg>'
        f'<rect class="frame" width="{inner_width}" height="{inner_height}"/></g></svg>'
    )


def _scale(
    wanted: tuple[float, float] | None,
    extents: Sequence[tuple[float, float]],
    length: float,
    log: bool,
    flip: bool,
    air: float,
) -> Scale:
    finite = [e for e in extents if np.all(np.isfinite(e))]
    low, high = wanted or (min((e[0] for e in finite), default=0.0), max((e[1] for e in finite), default=1.0))
    if wanted is None and log:
        low, high = padded_log(low, high)
    elif wanted is None and (air or high <= low):
        low, high = padded(low, high, air or 0.06)
    return Scale(low, high, length, log, flip)


def _extent_x(mark: Mark) -> tuple[float, float]:
    x = mark.edges if isinstance(mark, Bars) else mark.x
    return (float(x[0]), float(x[-1])) if len(x) else (np.nan, np.nan)


def _extent_y(mark: Mark, x_scale: Scale) -> tuple[float, float]:
    if isinstance(mark, Bars):
        return 0.0, float(np.max(mark.heights, initial=0.0))
    seen = (mark.x >= x_scale.low) & (mark.x <= x_scale.high)
    values = [mark.y[seen]] if isinstance(mark, Curve) else [mark.low[seen], mark.high[seen]]
    y = np.concatenate(values)
    y = y[np.isfinite(y)]
    return (float(y.min()), float(y.max())) if len(y) else (np.nan, np.nan)


def _grid(axes: Axes, x: Scale, y: Scale, width: float, height: float) -> str:
    parts = []
    for value, label in y.ticks(max(int(height / PIXELS_PER_TICK["y"]), 4)):
        at = f"{float(y(value)):.1f}"
        parts.append(f'<path class="grid" d="M0 {at}H{width}"/><text class="y" x="-7" y="{at}">{label}</text>')
    ticks = []
    for value, label in x.ticks(max(int(width / PIXELS_PER_TICK["x"]), 2)):
        at = f"{float(x(value)):.1f}"
        text = f'<text class="x" x="{at}" y="{height + 14}">{label}</text>' if axes.x_label else ""
        ticks.append(f'<path class="grid" d="M{at} 0V{height}"/>{text}')
    parts.append(f'<g class="xticks">{"".join(ticks)}</g>')
    for value, label in axes.levels:
        level = float(y(value))
        parts.append(
            f'<path class="level" d="M0 {level:.1f}H{width}"/>'
            f'<text class="level{" left" if axes.level_at_left else ""}" '
            f'x="{4 if axes.level_at_left else width - 4}" y="{level - 4:.1f}">{escape(label)}</text>'
        )
    if axes.x_label:
        parts.append(f'<text class="xlabel" x="{width / 2:.0f}" y="{height + 30}">{escape(axes.x_label)}</text>')
    return "".join(parts)


def _shade(axes: Axes, x_scale: Scale, height: float) -> str:
    if axes.shade is None:
        return ""
    a, b = (round(float(x_scale(x)) * UNITS_PER_PIXEL) for x in axes.shade)
    return f'<rect class="shade" x="{a}" width="{b - a}" height="{height}"/>'


def _draw(mark: Mark, x_scale: Scale, y_scale: Scale, height: float) -> str:
    name = escape(mark.name, quote=True)
    if isinstance(mark, Bars):
        return f'<path class="bars {mark.colour}" data-name="{name}" d="{_bars(mark, x_scale, y_scale, height)}"/>'
    seen = _seen(mark.x, x_scale)
    if isinstance(mark, Band):
        x, low, high = thin(mark.x[seen], mark.low[seen], mark.high[seen], points=BAND_POINTS)
        outline = path(x_scale(np.append(x, x[::-1])), y_scale(np.append(high, low[::-1])))
        return f'<path class="band {mark.colour}" d="{outline}z"/>' if outline else ""
    x, y = min_max(mark.x[seen], mark.y[seen], mark.points)
    cls = f"{mark.style} {mark.colour}"
    if mark.style == "dots":  # nothing between them
        x, y = (np.column_stack([values, np.full(len(values), np.nan)]).ravel() for values in (x, y))
    return f'<path class="{cls}" data-name="{name}" d="{path(x_scale(x), y_scale(y))}"/>'


def _seen(x: Array, scale: Scale) -> slice:
    """The samples inside the limits and one on each side, so that the line runs to the frame."""
    first, last = np.searchsorted(x, [scale.low, scale.high])
    return slice(max(int(first) - 1, 0), int(last) + 1)


def path(x: Array, y: Array) -> str:
    """A polyline as SVG path data with relative whole numbers; NaN lifts the pen."""
    good = np.isfinite(x) & np.isfinite(y)
    if not good.any():
        return ""
    xi = np.rint(np.where(good, x, 0.0) * UNITS_PER_PIXEL).astype(int)
    yi = np.rint(np.where(good, y, 0.0) * UNITS_PER_PIXEL).astype(int)
    parts = []
    changes = np.flatnonzero(np.diff(np.concatenate([[0], good.astype(int), [0]])))
    for start, stop in changes.reshape(-1, 2):
        steps = np.column_stack([np.diff(xi[start:stop]), np.diff(yi[start:stop])])
        text = " ".join(f"{dx} {dy}" for dx, dy in steps.tolist() if dx or dy)
        parts.append(f"M{xi[start]} {yi[start]}" + (f"l{text.replace(' -', '-')}" if text else "h0"))
    return "".join(parts)


def _bars(mark: Bars, x_scale: Scale, y_scale: Scale, height: float) -> str:
    x = np.rint(x_scale(mark.edges) * UNITS_PER_PIXEL).astype(int)
    y = np.rint(y_scale(mark.heights) * UNITS_PER_PIXEL).astype(int)
    bottom = round(height)
    return "".join(f"M{x[i] + 4} {bottom}V{y[i]}H{x[i + 1] - 4}V{bottom}z" for i in range(len(y)) if y[i] < bottom)


def min_max(x: Array, y: Array, points: int = POINTS) -> tuple[Array, Array]:
    """A curve with at most about `points` points and the same outline.

    Args:
        x: abscissa, increasing, shape (m,).
        y: ordinate, NaN where the curve is interrupted, shape (m,).
        points: number of points wanted.

    Returns:
        Some of the points, in order.
    """
    if len(x) <= points:
        return x, y
    size = -(-len(x) // (points // 2))
    whole = len(x) // size * size
    blocks = y[:whole].reshape(-1, size)
    broken = np.isnan(blocks)
    start = np.arange(len(blocks)) * size
    lowest = start + np.argmin(np.where(broken, np.inf, blocks), axis=1)
    highest = start + np.argmax(np.where(broken, -np.inf, blocks), axis=1)
    # a stretch that is interrupted anywhere must stay interrupted, or the pen would cross the hole
    hole = start[broken.any(axis=1)] + np.argmax(broken[broken.any(axis=1)], axis=1)
    keep = np.unique(np.concatenate([[0], lowest, highest, hole, np.arange(whole, len(x))]))
    return x[keep], y[keep]


def thin(x: Array, *ys: Array, points: int = POINTS) -> tuple[Array, ...]:
    """Evenly chosen points of smooth curves (limits of a band)."""
    keep = np.unique(np.linspace(0, len(x) - 1, min(points, len(x))).astype(int))
    return (x[keep], *(y[keep] for y in ys))
