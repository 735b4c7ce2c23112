# SPDX-License-Identifier: BSD-3-Clause
"""A picture of a report as PDF."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
from cssselect2 import ElementWrapper
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path
from matplotlib.transforms import Affine2D, Transform, TransformedPath

from jointscope.tools.report.pdf.styles import Style, styled, value

INCH = 96.0  # [px]
POINT = 72.0 / INCH  # [pt/px]
STEP = re.compile(r"(translate|rotate)\(([^)]*)\)")
ANCHORS = {"start": "left", "middle": "center", "end": "right"}
SEMIBOLD = 600  # fonts of matplotlib know normal and bold
Clip = TransformedPath | None
PART = re.compile(r"([A-Za-z])([^A-Za-z]*)")
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
TAKES = {"M": 2, "L": 2, "H": 1, "V": 1, "Z": 0}  # numbers a step; reports draw in straight lines


def pdf_picture(svg: str) -> bytes:
    """One page of the size of the picture, in vectors, with fonts inside; the same file each time.

    Args:
        svg: a file that `picture` made.

    Raises:
        ValueError: the picture has a shape that no report draws.
    """
    root = ElementTree.fromstring(svg)
    x, y, width, height = _numbers(root.attrib["viewBox"])
    figure = Figure(figsize=(width / INCH, height / INCH))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(x, x + width), ylim=(y + height, y))
    axes.set_axis_off()
    placed: dict[int, tuple[Transform, Clip]] = {}
    for order, (element, style) in enumerate(styled(root)):
        above = element.parent
        begin = placed[id(above.etree_element)] if above is not None else (Affine2D(), None)
        placed[id(element.etree_element)] = where, clip = _place(axes, element, begin, above is None)
        if artist := _drawn(axes, element, style, where):
            artist.set(zorder=order, clip_on=clip is not None)
            if clip is not None:
                artist.set_clip_path(clip)
    page = io.BytesIO()
    with mpl.rc_context({"pdf.fonttype": 42}):  # journals refuse fonts of type 3
        figure.savefig(page, format="pdf", metadata={"CreationDate": None, "Creator": None, "Producer": None})
    return page.getvalue()


def _place(axes: Axes, element: ElementWrapper, begin: tuple[Transform, Clip], outer: bool) -> tuple[Transform, Clip]:
    """Where the inside of an element lies on the page, and what is seen of it."""
    given = element.etree_element.attrib
    where, clip = begin
    if element.local_name == "svg" and not outer:
        left, top = float(given.get("x", 0)), float(given.get("y", 0))
        width, height = float(given["width"]), float(given["height"])
        x, y, across, down = _numbers(given.get("viewBox", f"0 0 {width} {height}"))
        if "data" in element.classes:
            seen = Affine2D().scale(width, height).translate(left, top) + where
            clip = TransformedPath(Path.unit_rectangle(), seen + axes.transData)
        where = Affine2D().translate(-x, -y).scale(width / across, height / down).translate(left, top) + where
    for name, text in STEP.findall(given.get("transform", "")):
        first, *others = _numbers(text)
        if name == "translate":
            where = Affine2D().translate(first, others[0] if others else 0.0) + where
        else:
            x, y = others or (0.0, 0.0)
            where = Affine2D().rotate_deg_around(x, y, first) + where
    return where, clip


def _drawn(axes: Axes, element: ElementWrapper, style: Style, where: Transform) -> Any:
    if value(style, "display") == "none":
        return None
    given = element.etree_element.attrib
    if element.local_name == "text":
        return _text(axes, element, style, where)
    if element.local_name == "path":
        shape: Any = PathPatch(path_of(given["d"]))
    elif element.local_name == "rect":
        shape = Rectangle(
            (float(given.get("x", 0)), float(given.get("y", 0))), float(given["width"]), float(given["height"])
        )
    else:
        return None
    shape.set_transform(where + axes.transData)
    shape.set(**_paint(style))
    return axes.add_artist(shape)


def _paint(style: Style) -> dict[str, Any]:
    """Colours and lines; widths are those on the page, as of strokes that no stretching widens."""
    fill, stroke = value(style, "fill", "black"), value(style, "stroke", "none")
    width = POINT * _length(style, "stroke-width", 1.0)
    dashes = value(style, "stroke-dasharray", "none")
    return {
        "facecolor": ("none" if fill == "none" else (fill, _length(style, "fill-opacity", 1.0))),
        "edgecolor": ("none" if stroke == "none" else (stroke, _length(style, "stroke-opacity", 1.0))),
        "linewidth": 0.0 if stroke == "none" else width,
        "linestyle": "-" if dashes == "none" else (0.0, [POINT * part / max(width, 1e-9) for part in _numbers(dashes)]),
        "capstyle": {"round": "round", "square": "projecting"}.get(value(style, "stroke-linecap"), "butt"),
        "joinstyle": {"round": "round", "bevel": "bevel"}.get(value(style, "stroke-linejoin"), "miter"),
        "snap": False,
    }


def _text(axes: Axes, element: ElementWrapper, style: Style, where: Transform) -> Any:
    given = element.etree_element.attrib
    words = "".join(element.etree_element.itertext())
    at = where.transform((float(given.get("x", 0)), float(given.get("y", 0))))
    begin, end = where.transform([(0.0, 0.0), (1.0, 0.0)])
    right, down = end - begin
    fill = value(style, "fill", "black")
    if not words.strip() or fill == "none":
        return None
    return axes.text(
        at[0],
        at[1],
        words,
        color=(fill, _length(style, "fill-opacity", 1.0)),
        size=POINT * _length(style, "font-size", 16.0),
        weight="bold" if _weight(style) >= SEMIBOLD else "normal",
        ha=ANCHORS[value(style, "text-anchor", "start")],
        va="center_baseline" if value(style, "dominant-baseline") == "central" else "baseline",
        rotation=math.degrees(math.atan2(-down, right)),
        rotation_mode="anchor",
        parse_math=False,
    )


def _weight(style: Style) -> float:
    weight = value(style, "font-weight", "normal")
    return {"normal": 400.0, "bold": 700.0}.get(weight) or float(weight)


def _length(style: Style, name: str, default: float) -> float:
    return float(value(style, name, f"{default}").removesuffix("px"))


def _numbers(text: str) -> list[float]:
    return [float(number) for number in text.replace(",", " ").split()]


def path_of(d: str) -> Path:
    """Straight lines of a path in the units of the file.

    Args:
        d: moves and lines, absolute or from the last point.

    Raises:
        ValueError: the path has a curve.
    """
    points, codes = [], []
    for code, point in _steps(d):
        points.append(point)
        codes.append(code)
    return Path(points, codes) if points else Path([(0.0, 0.0)], [Path.MOVETO])


def _steps(d: str) -> Iterator[tuple[np.uint8, tuple[float, float]]]:
    x = y = 0.0
    begin = (x, y)
    for letter, text in PART.findall(d):
        numbers = [float(number) for number in NUMBER.findall(text)]
        kind = letter.upper()
        if kind not in TAKES:
            raise ValueError(f"path with {letter!r}: expected one of {', '.join(TAKES)}")
        if kind == "Z":
            x, y = begin
            yield Path.CLOSEPOLY, begin
            continue
        for k in range(0, len(numbers), TAKES[kind]):
            step = dict(zip("xy" if TAKES[kind] == 2 else ("x" if kind == "H" else "y"), numbers[k:], strict=False))
            if letter.islower():
                x, y = x + step.get("x", 0.0), y + step.get("y", 0.0)
            else:
                x, y = step.get("x", x), step.get("y", y)
            if kind == "M" and not k:
                begin = (x, y)
                yield Path.MOVETO, begin
            else:
                yield Path.LINETO, (x, y)
