# SPDX-License-Identifier: BSD-3-Clause
"""A table whose cells are coloured by what they hold."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

DARK = 0.6  # strength above which the text turns light


@dataclass(frozen=True)
class HeatCell:
    """Text, strength of the colour from 0 to 1, class of the colour, and what the pointer shows; plain text."""

    text: str
    strength: float
    colour: str = "k0"
    tip: str = ""


def heat_table(corner: str, columns: Sequence[str], rows: Sequence[tuple[str, Sequence[HeatCell]]]) -> str:
    """The table; names may be long, they break at dots.

    Args:
        corner: heading of the first column.
        columns: headings.
        rows: name and cells of each row.
    """
    head = "".join(f"<th>{_breakable(name)}</th>" for name in columns)
    body = "".join(f"<tr><th>{escape(name)}</th>{''.join(map(_cell, cells))}</tr>" for name, cells in rows)
    return (
        f'<div class="scroll"><table class="heat"><thead><tr><th>{escape(corner)}</th>{head}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def _cell(cell: HeatCell) -> str:
    strength = min(max(cell.strength, 0.0), 1.0)
    tip = f' title="{escape(cell.tip, quote=True)}"' if cell.tip else ""
    strong = " strong" if strength > DARK else ""
    return f'<td class="{cell.colour}{strong}" style="--h:{strength:.2f}"{tip}>{escape(cell.text)}</td>'


def _breakable(name: str) -> str:
    return re.sub(r"([._])(?=[a-z])", r"\1<wbr>", escape(name))
