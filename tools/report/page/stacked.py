# SPDX-License-Identifier: BSD-3-Clause
"""Several pictures with their legend as one SVG element."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape

from jointscope.tools.report.page.page import Key

WIDEST = 1096  # [px] three small maps beside each other
GAP = 8  # [px]
LINE = 20  # [px] of the legend and of a title
SAMPLE = 26  # [px] of a line in the legend
CHARACTER = 6.4  # [px] mean width in the font of the legend
OPENING = re.compile(r"<svg\b([^>]*)>")
SIZE = re.compile(r' (?:width|height|style)="[^"]*"')


def stacked(elements: Sequence[str], keys: Sequence[Key] = (), title: str = "", spoken: str = "") -> str:
    """Puts pictures beside each other while there is room, the others below.

    Args:
        elements: SVG elements with a viewBox in pixels.
        keys: legend above them.
        title: line above everything; plain text.
        spoken: what it shows, for those who hear it; the title if not given.

    Returns:
        One SVG element with a viewBox in pixels.
    """
    placed, y, x, row = [], float(LINE if title else 0), 0.0, 0.0
    boxes = [_box(element) for element in elements]
    width = max((box[2] for box in boxes), default=0.0)
    legend, y = _legend(keys, max(width, WIDEST / 2), y)
    for element, (*_, w, h) in zip(elements, boxes, strict=True):
        if x and x + w > max(width, WIDEST):
            x, y, row = 0.0, y + row + GAP, 0.0
        placed.append(_at(element, x, y, w, h))
        x, row = x + w + GAP, max(row, h)
        width = max(width, x - GAP)
    head = f'<text class="title" x="0" y="13">{escape(title)}</text>' if title else ""
    return (
        f'<svg viewBox="0 0 {width:g} {y + row:g}" role="img" aria-label="{escape(spoken or title, quote=True)}">'
        f"{head}{legend}{''.join(placed)}</svg>"
    )


_SAMPLES = {"band": "M{x:g} {top:g}h{width}v8h-{width}z", "dots": "M{centre:g} {middle:g}h0"}
"""What a legend shows of a style; a line of all others."""


def _legend(keys: Sequence[Key], width: float, y: float) -> tuple[str, float]:
    """Samples and texts, in as many lines as they need; and where they end [px]."""
    parts, x = [], 0.0
    for key in keys:
        length = SAMPLE + 8 + CHARACTER * len(key.text) + 16
        if x and x + length > width:
            x, y = 0.0, y + LINE
        shape = _SAMPLES.get(key.style, "M{x:g} {middle:g}h{width}").format(
            x=x, top=y + 6.0, middle=y + 10.0, width=SAMPLE, centre=x + 0.5 * SAMPLE
        )
        parts.append(
            f'<path class="{key.style} {key.colour}" d="{shape}"/>'
            f'<text class="name" x="{x + SAMPLE + 6:g}" y="{y + 10:g}">{escape(key.text)}</text>'
        )
        x += length
    return (f'<g class="legend">{"".join(parts)}</g>', y + LINE + GAP) if parts else ("", y)


def _box(element: str) -> tuple[float, float, float, float]:
    """The viewBox [px]."""
    x, y, width, height = (float(number) for number in element.partition('viewBox="')[2].partition('"')[0].split())
    return x, y, width, height


def _at(element: str, x: float, y: float, width: float, height: float) -> str:
    """The element at a place, in its own size."""
    place = f'<svg x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}"'
    return OPENING.sub(lambda found: f"{place}{SIZE.sub('', found[1])}>", element, count=1)
