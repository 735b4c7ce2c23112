# SPDX-License-Identifier: BSD-3-Clause
"""A plot of a report as a picture file of its own."""

from __future__ import annotations

from jointscope.tools.report.page.page import FOLDER

SPACE = 12  # [px] around the plot


def picture(svg: str) -> str:
    """An SVG file with style and background, light or dark as the reader's screen.

    Args:
        svg: an element as the sections draw it.
    """
    start, _, rest = svg.partition('viewBox="')
    box, _, rest = rest.partition('"')
    x, y, width, height = (float(number) for number in box.split())
    x, y, width, height = x - SPACE, y - SPACE, width + 2 * SPACE, height + 2 * SPACE
    style = (FOLDER / "page.css").read_text(encoding="utf-8").replace("<", "&lt;").replace(">", "&gt;")
    opening, _, content = rest.partition(">")
    return (
        f'{start}xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="{height:g}" '
        f'viewBox="{x:g} {y:g} {width:g} {height:g}"{opening}><style>{style}</style>'
        f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" style="fill: var(--bg)"/>{content}'
    )
