# SPDX-License-Identifier: BSD-3-Clause
"""The page around the sections: head, style, script, contents, and the few building blocks that sections share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Section:
    """One part of a report.

    Attributes:
        id: anchor.
        title: heading and entry of the contents.
        body: HTML.
        lead: one sentence below the heading that says how to read the section; plain text.
    """

    id: str
    title: str
    body: str
    lead: str = ""

    def html(self) -> str:
        """The section as HTML."""
        lead = f'<p class="lead">{escape(self.lead)}</p>' if self.lead else ""
        return f'<section id="{self.id}"><h2>{escape(self.title)}</h2>{lead}{self.body}</section>'


def page(title: str, subtitle: str, sections: Sequence[Section]) -> str:
    """A whole HTML document with style and script inside.

    Args:
        title: heading of the page; plain text.
        subtitle: line below it; plain text.
        sections: in order; the first one has no heading in the contents of its own right, it is the answer.

    Returns:
        The document.
    """
    style = (FOLDER / "page.css").read_text(encoding="utf-8")
    script = (FOLDER / "page.js").read_text(encoding="utf-8")
    contents = "".join(f'<a href="#{s.id}">{escape(s.title)}</a>' for s in sections)
    body = "".join(s.html() for s in sections)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{style}</style></head><body>"
        f'<nav aria-label="contents"><div>{contents}</div></nav><main><header><div><h1>{escape(title)}</h1>'
        f'<p class="subtitle">{escape(subtitle)}</p></div>'
        '<button id="theme" type="button" aria-label="light or dark">◐</button></header>'
        f"{body}</main><script>{script}</script></body></html>\n"
    )


@dataclass(frozen=True)
class Key:
    """An entry of a legend: text, colour class, and style of its line ("band" for an area)."""

    text: str
    colour: str
    style: str = "solid"


def figure(panels: Iterable[str], keys: Sequence[Key] = (), caption: str = "", group: str = "") -> str:
    """Plots below each other with a legend.

    Args:
        panels: SVG elements.
        keys: legend; a click on an entry hides and shows the curves of that name.
        caption: plain text below.
        group: figures of one group zoom together in x.
    """
    legend = "".join(
        f'<button type="button" class="key" data-key="{escape(k.text, quote=True)}">'
        f'<svg width="26" height="10" aria-hidden="true"><path class="{k.style} {k.colour}" '
        f'd="{"M1 1h24v8h-24z" if k.style == "band" else "M1 5h24"}"/></svg>{escape(k.text)}</button>'
        for k in keys
    )
    legend = f'<div class="legend">{legend}</div>' if legend else ""
    text = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    data = f' data-group="{escape(group, quote=True)}"' if group else ""
    return f'<figure{data}>{legend}<div class="panels">{"".join(panels)}</div>{text}</figure>'


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """A table; cells are HTML already, heads are plain text.

    Args:
        head: headings.
        rows: cells.
        numbers: columns that hold numbers and are set flush right.
    """

    def cell(tag: str, i: int, text: str) -> str:
        return f'<{tag} class="n">{text}</{tag}>' if i in numbers else f"<{tag}>{text}</{tag}>"

    top = "".join(cell("th", i, escape(h)) for i, h in enumerate(head))
    body = "".join("<tr>" + "".join(cell("td", i, c) for i, c in enumerate(row)) + "</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'


def text_cells(head: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """A table of cells that are plain text."""
    return table(head, [[escape(cell) for cell in row] for row in rows], numbers)


def foldable(title: str, body: str) -> str:
    """Details that are closed at first."""
    return f"<details><summary>{escape(title)}</summary>{body}</details>"


def listed(items: Iterable[str], style: str = "") -> str:
    """An unordered list; items are HTML already, `style` is a class of the style sheet."""
    opened = f'<ul class="{style}">' if style else "<ul>"
    return f"{opened}{''.join(f'<li>{item}</li>' for item in items)}</ul>"


def sentence(text: str) -> str:
    """A finding as the end of a line reads well: capital first letter, full stop, a real plus-minus sign."""
    text = text.strip().replace("+-", "±")
    first = text.split(" ", 1)[0]
    # names such as joint1.stiffness keep their spelling
    name = any(mark in first for mark in "._@")  # of a parameter or an effect, which is written as it is
    start = text[:1].upper() if text[:1].isascii() and not name else text[:1]
    return start + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")
