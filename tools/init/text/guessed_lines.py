# SPDX-License-Identifier: BSD-3-Clause
"""The lines of a robot file that were guessed, for programs and for people."""

from __future__ import annotations

from itertools import pairwise

from jointscope.tools.init.text.robot_line import GUESS

# in the section of the command and of each sensor
SHARED_KEYS = ("names", "unit", "scale", "sigma", "field", "wraps", "kind", "held")


def guesses(text: str) -> list[str]:
    """The guessed lines of a robot file: "key: value (why)"."""
    found = []
    for line in text.splitlines():
        value, mark, why = line.partition(f"# {GUESS}: ")
        if mark:
            found.append(f"{value.strip()}  ({why})")
    return found


def guesses_in_sections(text: str) -> list[str]:
    """The same for people: keys that several sections have name theirs, and a section that was guessed its topic."""
    found, lines, section = [], text.splitlines(), ["", ""]
    for line, after in pairwise([*lines, ""]):
        depth = (len(line) - len(line.lstrip())) // 2
        key = line.strip().partition(":")[0]
        if depth < len(section) and line.strip():
            section[depth:] = [key, *section[depth + 1 :]]
        value, mark, why = line.partition(f"# {GUESS}: ")
        if not mark:
            continue
        said = value.strip()
        if said.endswith(":") and after.strip().startswith("topic:"):
            said += f" {after.partition('topic:')[2].partition('#')[0].strip()}"
        elif key in SHARED_KEYS:
            said = f"{section[min(depth, len(section)) - 1]} {said}"
        found.append(f"{said}  ({why})")
    return found
