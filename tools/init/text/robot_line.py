# SPDX-License-Identifier: BSD-3-Clause
"""Lines of a robot file: a text with its comment, numbers and lists as YAML reads them back."""

from __future__ import annotations

import re
from collections.abc import Iterable

GUESS = "GUESS"
COLUMN = 48  # where comments begin


def line(text: str, comment: str, sure: bool = True, indent: int = 0) -> str:
    """A line with its comment; one that is not sure is marked."""
    place = " " * indent + text
    return f"{place.ljust(COLUMN)} # {comment if sure else f'{GUESS}: {comment}'}"


def number(value: float, digits: int = 3) -> str:
    """Some digits, with a point, so that YAML reads a float."""
    text = f"{value:.{digits}g}"
    mantissa, e, exponent = text.partition("e")
    mantissa = mantissa if "." in mantissa else f"{mantissa}.0"
    return f"{mantissa}{e}{exponent}"


def plain(text: str) -> str:
    """A text as YAML reads it back."""
    simple = re.fullmatch(r"[A-Za-z_/.][\w./:-]*", text) and text.lower() not in ("yes", "no", "true", "false", "null")
    return text if simple else "'" + text.replace("'", "''") + "'"


def as_list(values: Iterable[object]) -> str:
    """A list in brackets."""
    return "[" + ", ".join(plain(value) if isinstance(value, str) else str(value) for value in values) + "]"
