# SPDX-License-Identifier: BSD-3-Clause
"""Joints that turn the other way than the URDF says, or are exchanged, where no gyroscope tells: the torques do.

With the axis of one joint the other way round, inertias and weights couple with the wrong sign, and so do they where
two joints have each other's names. Tried only where the regression leaves much, or says what cannot be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

from jointscope.graphs.screening.exchanged_joints import Exchange, Wiring
from jointscope.robots.model.robot import Robot
from jointscope.tools.init.estimates.joint_signs import SignGuess, Signs
from jointscope.tools.init.streams.other_joints import Typed

ALL_PATTERNS, MOST_TURNED = 4, 2  # joints up to which all patterns are tried, and joints turned together with more


def wiring_by_torques(wiring: Wiring) -> tuple[SignGuess | None, Exchange | None]:
    """Which way the encoders count, or which joints are exchanged, where the torques say otherwise than URDF and names.

    Args:
        wiring: the recording as URDF and names have it.
    """
    enough = wiring.enough()
    if not enough:
        return None, None
    signs = _signs(wiring, enough)
    return signs, None if signs is not None else wiring.exchange(enough)


def exchange_sentence(exchange: Exchange, robot: Robot, again: Typed) -> str:
    """What was seen, and what to do: to write the robot anew where both columns are, else a line of its file.

    Args:
        exchange: what was found.
        robot: as its file has been written.
        again: what was typed, with another file to write.
    """
    a, b = exchange.joints
    if len(exchange.columns) < 2:
        return exchange.sentence(robot)
    wish = replace(again.wish, joints=robot.joints, names={**again.wish.names, a: b, b: a})
    return f"{exchange.seen}; if that is so: {replace(again, wish=wish).command()}"


def _signs(wiring: Wiring, enough: float) -> SignGuess | None:
    """The fewest joints that, turned round, leave little enough."""
    n = wiring.tree.n
    for count in range(1, (n if n <= ALL_PATTERNS else MOST_TURNED) + 1):
        patterns = [_turned(n, which) for which in combinations(range(n), count)]
        found = [signs for signs in patterns if wiring.left(signs) < enough]
        if found:
            return SignGuess(found[0], tuple(found[1:]), by_torques=True)
    return None


def _turned(n: int, which: Sequence[int]) -> Signs:
    return tuple(-1.0 if j in which else 1.0 for j in range(n))
