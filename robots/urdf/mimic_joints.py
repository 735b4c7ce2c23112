# SPDX-License-Identifier: BSD-3-Clause
"""Joints of a URDF that follow another one: q_follower = factor q_leader + offset.

pinocchio's algorithms for accelerations know no such joints, so they are read here, and `Coupling` puts them into the
equations. A follower of a follower follows the first of the chain.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from jointscope.robots.errors import RobotError
from jointscope.robots.urdf.urdf_text import UrdfText


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


def followers_of(text: UrdfText, file: str) -> dict[str, Follower]:
    """All mimic joints of a URDF, each with the joint at the beginning of its chain.

    One whose leader is not in the file follows nothing: it is a joint like any other.

    Args:
        text: of a URDF that pinocchio has read, so that factors and offsets are numbers.
        file: its name.

    Raises:
        RobotError: a joint follows itself.
    """
    steps = {name: _step(mimic) for name, mimic in text.mimics.items() if mimic.get("joint") in text.joints}
    return {name: _first_leader(name, steps, file) for name in steps}


def _step(attributes: Mapping[str, str]) -> Follower:
    numbers = (float(attributes.get(key) or usual) for key, usual in (("multiplier", 1.0), ("offset", 0.0)))
    return Follower(attributes.get("joint", ""), *numbers)


def _first_leader(name: str, steps: Mapping[str, Follower], file: str) -> Follower:
    found, seen = Follower(name), {name}
    while found.leader in steps:
        step = steps[found.leader]
        if step.leader in seen:
            raise RobotError(
                f"{file}: joint {found.leader} mimics {step.leader}, which follows {found.leader} itself; remove one "
                "<mimic> of the ring"
            )
        seen.add(step.leader)
        found = Follower(step.leader, found.factor * step.factor, found.factor * step.offset + found.offset)
    return found
