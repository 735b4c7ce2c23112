# SPDX-License-Identifier: BSD-3-Clause
"""What a URDF's own text says about its joints, and the text as pinocchio's parser wants it.

Makers leave out limits that the parser insists on; they are put in as zeros, which means: not known. Prefixes that
nothing declares (leftovers of xacro, sections of simulators) are no mistake here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from xml.parsers import expat

LIMITED = ("revolute", "prismatic")
NO_LIMIT = b'<limit lower="0" upper="0" effort="0" velocity="0"/>'


class UrdfText:
    """One pass over a URDF; joints are the children of <robot>.

    Args:
        urdf: the file.

    Attributes:
        joints: names of all joints, fixed ones, too.
        mimics: attributes of <mimic>, by joint.
        trouble: why it is no XML; empty if it is.
        unread: the first place where a mass or an inertia is no number; empty if all are. The parser would leave the
            whole body out.
        weightless: links with an inertia and a mass of zero, as no body has.
        macro: the first place where bodies or joints wait for xacro; empty if there is none.
    """

    def __init__(self, urdf: Path):
        self._text = urdf.read_bytes()
        self.joints: set[str] = set()
        self.mimics: dict[str, Mapping[str, str]] = {}
        self.trouble = self.macro = self.unread = ""
        self.weightless: list[str] = []
        self._link, self._mass = "", math.nan
        self._open: list[str] = []
        self._joint: Mapping[str, str] = {}
        self._limited = False
        self._missing: list[tuple[int, bytes]] = []  # where something is missing, and what
        self._parser = parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EndElementHandler = self._begin, self._end
        try:
            parser.Parse(self._text, True)
        except expat.ExpatError as err:
            self.trouble = str(err)

    @property
    def completed(self) -> str | None:
        """The text with all limits; None if none is missing."""
        if not self._missing or self.trouble:
            return None
        pieces, last = [], 0
        for place, missing in self._missing:
            pieces += [self._text[last:place], missing]
            last = place
        return b"".join([*pieces, self._text[last:]]).decode(errors="replace")

    def _begin(self, tag: str, attributes: Mapping[str, str]) -> None:
        self._open.append(tag)
        if not self.macro:
            self.macro = self._expression(tag, attributes)
        name = self._joint.get("name", "")
        if self._open == ["robot", "link"]:
            self._link, self._mass = attributes.get("name", ""), math.nan
        elif self._open[:-1] == ["robot", "link", "inertial"] and tag in ("mass", "inertia"):
            self._weigh(tag, attributes)
        if self._open == ["robot", "joint"]:
            self._joint, self._limited = attributes, False
            self.joints.add(attributes.get("name", ""))
        elif self._open == ["robot", "joint", "mimic"]:
            self.mimics[name] = attributes
        elif self._open == ["robot", "joint", "limit"]:
            self._limited = True
            behind = self._parser.CurrentByteIndex + len(b"<limit")
            self._missing += [
                (behind, b' %s="0"' % key) for key in (b"effort", b"velocity") if key.decode() not in attributes
            ]

    def _weigh(self, tag: str, attributes: Mapping[str, str]) -> None:
        """Looks at the numbers of a body: the mass, or what stands after it in the inertia."""
        numbers = {key: _number(value) for key, value in attributes.items()}
        odd = next((key for key, number in numbers.items() if not math.isfinite(number)), "")
        if odd and not self.unread:
            where = f'line {self._parser.CurrentLineNumber}: <{tag} {odd}="{attributes[odd]}"> of link {self._link}'
            self.unread = f"{where} is no number"
        if tag == "mass":
            self._mass = numbers.get("value", math.nan)
        elif self._mass == 0.0 and any(numbers.values()):
            self.weightless.append(self._link)

    def _end(self, tag: str) -> None:
        whole = self._open == ["robot", "joint"] and not self._limited
        place = self._parser.CurrentByteIndex
        # an empty element <joint/> has no end tag, and no parent link either
        if whole and self._joint.get("type") in LIMITED and self._text[place : place + 2] == b"</":
            self._missing.append((place, NO_LIMIT))
        self._open.pop()

    def _expression(self, tag: str, attributes: Mapping[str, str]) -> str:
        """Where an attribute of a body or joint is an expression of xacro; how it looks is no matter."""
        if "visual" in self._open or "collision" in self._open or self._open[1:2] not in (["link"], ["joint"]):
            return ""
        found = next((f'{key}="{value}"' for key, value in attributes.items() if "${" in value), "")
        return found and f"line {self._parser.CurrentLineNumber}: <{tag} {found}>"


def _number(text: str) -> float:
    """As the parser reads it, which knows no decimal comma."""
    try:
        return float(text)
    except ValueError:
        return math.nan
