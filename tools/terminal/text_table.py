# SPDX-License-Identifier: BSD-3-Clause
"""Tables for the terminal."""

from __future__ import annotations

from collections.abc import Sequence


def text_table(head: Sequence[str], rows: Sequence[Sequence[str]], align: str, indent: int = 2) -> str:
    """Lines up columns.

    Args:
        head: titles of the columns.
        rows: cells.
        align: one character per column, "<" or ">".
        indent: spaces before each line.

    Returns:
        One line for the titles and one per row.
    """
    lines = [head, *rows]
    widths = [max(len(line[k]) for line in lines) for k in range(len(head))]
    return "\n".join(
        (
            " " * indent
            + "  ".join(f"{cell:{side}{width}}" for cell, side, width in zip(line, align, widths, strict=True))
        ).rstrip()
        for line in lines
    )
