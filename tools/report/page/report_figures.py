# SPDX-License-Identifier: BSD-3-Clause
"""The pictures of a report as files of their own, each with its legend."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import unescape

from jointscope.tools.report.page.page import Key
from jointscope.tools.report.page.picture import picture
from jointscope.tools.report.page.stacked import stacked

SECTION = re.compile(r'<section id="([^"]+)">(.*?)</section>', re.DOTALL)
FIGURE = re.compile(r"<figure\b.*?</figure>", re.DOTALL)
KEY = re.compile(r'data-key="([^"]*)"><svg[^>]*><path class="(\w+) ([^"]+)"')
TAG = re.compile(r"<svg\b[^>]*>|</svg>")


def report_figures(html: str) -> dict[str, str]:
    """Every picture of a page; bars inside of tables are none.

    Args:
        html: a report.

    Returns:
        SVG files by name: the anchor of the section, with a number where it has several.
    """
    found = {}
    for anchor, body in SECTION.findall(html):
        whole = [(list(_elements(figure)), _keys(figure)) for figure in FIGURE.findall(body)]
        alone: list[tuple[list[str], list[Key]]] = [([element], []) for element in _elements(FIGURE.sub("", body))]
        pictures = [stacked(elements, keys, anchor) for elements, keys in (*whole, *alone) if elements]
        for k, element in enumerate(pictures, start=1):
            found[f"{anchor}{f'-{k}' if len(pictures) > 1 else ''}.svg"] = picture(element)
    return found


def _keys(figure: str) -> list[Key]:
    return [Key(unescape(text), colour, style) for text, style, colour in KEY.findall(figure)]


def _elements(html: str) -> Iterator[str]:
    """Outermost SVG elements that are pictures, not signs."""
    depth, start = 0, 0
    for tag in TAG.finditer(html):
        if tag[0] == "</svg>":
            depth -= 1
            element = html[start : tag.end()]
            if not depth and 'role="img"' in element.partition(">")[0]:
                yield element
        else:
            start = start if depth else tag.start()
            depth += 1
