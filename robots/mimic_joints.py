# SPDX-License-Identifier: BSD-3-Clause
"""Joints of a URDF that follow another one: q_follower = factor q_leader + offset.

pinocchio's algorithms for accelerations know no such joints, so they are read here, and `Coupling` puts them into the
equations. A follower of a follower follows the first of the chain.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

import numpy as np

from jointscope.robots.errors import RobotError


@dataclass(frozen=True)
class Follower:
    """What a mimic joint follows.

    Attributes:
        leader: name of the joint.
        factor: of its position.
        offset: added to that [rad] or [m].
    """

    leader: str
    factor: float = 1.0
    offset: float = 0.0

    def position(self, leader: float) -> float:
        """Position of the follower for one of the leader [rad] or [m]."""
        return self.factor * leader + self.offset


def read_followers(urdf: Path) -> dict[str, Follower]:
    """All mimic joints of a URDF, each with the joint at the beginning of its chain.

    One whose leader is not in the file follows nothing: it is a joint like any other.

    Raises:
        RobotError: one follows itself; factor or offset is no finite number.
    """
    joints = _Joints(urdf)
    found = {name: _first_leader(name, joints, urdf) for name in joints.mimics}
    return {name: follower for name, follower in found.items() if follower.leader in joints.names}


def _first_leader(name: str, joints: _Joints, urdf: Path) -> Follower:
    found, seen = Follower(name), {name}
    while found.leader in joints.mimics:
        step = joints.mimics[found.leader]
        if step.leader in seen:
            raise RobotError(
                f"{urdf.name}: joint {found.leader} mimics {step.leader}, which follows {found.leader} itself; remove "
                "one <mimic> of the ring"
            )
        seen.add(step.leader)
        found = Follower(step.leader, found.factor * step.factor, found.factor * step.offset + found.offset)
    return found


class _Joints:
    """The joints of a URDF, which are children of <robot>, and their <mimic>; prefixes need no declaration."""

    def __init__(self, urdf: Path):
        self.names: set[str] = set()
        self.mimics: dict[str, Follower] = {}
        self._open: list[str] = []
        self._joint, self._urdf = "", urdf
        parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EndElementHandler = self._begin, self._end
        try:
            parser.Parse(urdf.read_bytes(), True)
        except expat.ExpatError as err:
            raise RobotError(f"{urdf} is not a URDF: {err}; expected XML that begins with <robot>") from err

    def _begin(self, tag: str, attributes: Mapping[str, str]) -> None:
        self._open.append(tag)
        if self._open == ["robot", "joint"]:
            self._joint = attributes.get("name", "")
            self.names.add(self._joint)
        elif self._open == ["robot", "joint", "mimic"] and self._joint:
            factor, offset = (self._number(attributes, key, usual) for key, usual in (("multiplier", 1), ("offset", 0)))
            self.mimics[self._joint] = Follower(attributes.get("joint", ""), factor, offset)

    def _end(self, _: str) -> None:
        self._open.pop()

    def _number(self, attributes: Mapping[str, str], key: str, usual: float) -> float:
        text = attributes.get(key, str(usual))
        try:
            value = float(text)
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            raise RobotError(
                f"{self._urdf.name}: joint {self._joint}, <mimic {key}={text!r}>: expected a finite number"
            )
        return value
