# SPDX-License-Identifier: BSD-3-Clause
"""Joints of a URDF and the names that messages have for them: the same, or the same ending.

Names are split at `_`, `/`, `::`, between letters and digits and at capitals, without regard to upper and lower case;
a last word `joint` says nothing. `arm_left_1` and `left_1` end alike, and so do `panda_joint1` and `joint_1`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
SIDES = ({"left", "l"}, {"right", "r"})
SUFFIXES = ("joint", "jnt", "link", "motor")  # last words that say nothing


@dataclass(frozen=True)
class NameMatch:
    """Who is who.

    Attributes:
        found: joint of the URDF and its name in the messages.
        alike: those of `found` whose names are not the same.
        ambiguous: joints that could have one name, or names that one joint could have, as (name, candidates).
    """

    found: Mapping[str, str]
    alike: tuple[str, ...]
    ambiguous: tuple[tuple[str, tuple[str, ...]], ...]


def match_names(joints: Sequence[str], names: Sequence[str]) -> NameMatch:
    """Finds names for joints: the same name first, then the longest common ending if only one pair has it.

    Args:
        joints: of the URDF.
        names: in the messages, all different.
    """
    found = {joint: joint for joint in joints if joint in names}
    joints = [joint for joint in joints if joint not in found]
    names = [name for name in names if name not in found]
    words = {text: _words(text) for text in (*joints, *names)}
    score = {(j, n): _alike(words[j], words[n]) for j in joints for n in names}
    alike: list[str] = []
    ambiguous: dict[str, tuple[str, ...]] = {}
    for level in sorted({value for value in score.values() if value[0]}, reverse=True):
        pairs = [pair for pair, value in score.items() if value == level]
        pairs = [(j, n) for j, n in pairs if j not in found and n not in found.values()]
        for j, n in pairs:
            by_joint, by_name = [b for a, b in pairs if a == j], [a for a, b in pairs if b == n]
            if len(by_joint) == len(by_name) == 1:
                found[j] = n
                alike.append(j)
            elif len(by_name) > 1:
                ambiguous.setdefault(n, tuple(by_name))
            else:
                ambiguous.setdefault(j, tuple(by_joint))
    taken = {*found, *found.values()}
    left = tuple((text, others) for text, others in ambiguous.items() if text not in taken and not taken & set(others))
    return NameMatch(found, tuple(alike), left)


def _words(name: str) -> tuple[str, ...]:
    words = [word.lower() for word in WORD.findall(name)]
    while len(words) > 1 and words[-1] in SUFFIXES:
        words.pop()
    return tuple(words)


def _alike(a: tuple[str, ...], b: tuple[str, ...]) -> tuple[int, int]:
    """How much two names have in common, (0, 0) for nothing: all, all of the shorter one, or the ending."""
    if "".join(a) == "".join(b):
        return (3, len(a))
    common = 0
    while common < min(len(a), len(b)) and a[-1 - common] == b[-1 - common]:
        common += 1
    ending = a[len(a) - common :]
    if not any(word.isalpha() for word in ending) or ending == ("joint",) or _other_side(a, b):
        return (0, 0)
    return (2 if common == min(len(a), len(b)) else 1, common)


def _other_side(a: tuple[str, ...], b: tuple[str, ...]) -> bool:
    left, right = SIDES
    return any(one & set(a) and other & set(b) for one, other in ((left, right), (right, left)))
