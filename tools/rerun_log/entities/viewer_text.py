# SPDX-License-Identifier: BSD-3-Clause
"""Text and paths as the viewer can take them.

The viewer's only font has Latin, Greek and Cyrillic letters and common signs; it stops (not: draws a box) at a letter
that it does not have, so that one file name in another script would make a whole recording impossible to open.
"""

from __future__ import annotations

import unicodedata

# every letter of these was drawn by the viewer 0.41 once; MISSING are the holes in them
RANGES = ((0x20, 0x17F), (0x384, 0x3CE), (0x400, 0x45F))
SIGNS = set("\n\t–—‘’“”…−→≤≥≠≈∞√·⁻⁰⁴⁵⁶⁷⁸⁹✓")

MISSING = {"\u0149", "\u038b", "\u038d", "\u03a2"}


def viewer_text(text: str) -> str:
    """The same text with letters that the viewer lacks replaced by the nearest known ones, or by "?"."""
    return "".join(_known(letter) for letter in text)


def entity(*parts: str) -> str:
    """An entity path from names that may contain anything; empty parts are left out."""
    import rerun as rr

    return "/".join(rr.escape_entity_path_part(viewer_text(part)) for part in parts if part)


def _known(letter: str) -> str:
    if _drawable(letter):
        return letter
    simpler = "".join(c for c in unicodedata.normalize("NFKD", letter) if _drawable(c))
    return simpler or "?"


def _drawable(letter: str) -> bool:
    code = ord(letter)
    if letter in MISSING:
        return False
    return (any(low <= code <= high for low, high in RANGES) and code not in range(0x7F, 0xA0)) or letter in SIGNS
