# SPDX-License-Identifier: BSD-3-Clause
"""Joints that turn the other way than the URDF says, or are exchanged, where no gyroscope tells: the torques do.

With the axis of one joint the other way round, inertias and weights couple with the wrong sign, and so do they where
two joints have each other's names. Tried only where the regression leaves much, or says what cannot be.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.starts.drive_regression import GAIN, DriveEquation
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.recordings.recording import Stream
from jointscope.tools.init.estimates.drive_values import is_impossible
from jointscope.tools.init.estimates.joint_signs import SignGuess, Signs
from jointscope.tools.init.estimates.open_share import equations_of, open_share
from jointscope.tools.init.streams.other_joints import Typed

Array = NDArray[np.float64]

POOR = 0.03  # of the torque that a right wiring may leave; more is looked into
CLEARLY = 3.0  # times less that another wiring must leave
ALL_PATTERNS, MOST_TURNED = 4, 2  # joints up to which all patterns are tried, and joints turned together with more
MOST_JOINTS = 8  # whose exchanges are tried
POSITIONS, COMMANDS = "positions", "commands"


@dataclass(frozen=True)
class Exchange:
    """Two joints that have each other's columns.

    Attributes:
        joints: the two.
        columns: whose: some of "positions", "commands".
    """

    joints: tuple[str, str]
    columns: tuple[str, ...]

    def sentence(self, typed: Typed, joints: Sequence[str]) -> str:
        """What was seen, and what to do; `joints` are those of the robot file, `typed` what writes it."""
        a, b = self.joints
        wish = replace(typed.wish, joints=tuple(joints), names={**typed.wish.names, a: b, b: a})
        seen = f"{' and '.join(self.columns)} of {a} and {b} seem to be exchanged: so the regression explains them"
        if len(self.columns) == 2:
            return f"{seen}; if that is so: {replace(typed, wish=wish).command()}"
        where = "sensors.motor_encoder" if self.columns == (POSITIONS,) else "command"
        return f"{seen}; if that is so, exchange them in `names` of {where}"


def wiring_by_torques(
    tree: RigidTree, encoder: Stream, command: Stream, *, held: bool
) -> tuple[SignGuess | None, Exchange | None]:
    """Which way the encoders count, or which joints are exchanged, where the torques say otherwise than URDF and names.

    Args:
        tree: the robot, with masses.
        encoder: positions [rad or m].
        command: what drives the joints.
        held: whether a command acts until the next one.
    """
    wiring = _Wiring(tree, encoder, command, held)
    as_is = wiring.left()
    if as_is < POOR:
        return None, None
    enough = min(POOR, as_is / CLEARLY)
    signs = _signs(wiring, enough)
    return signs, None if signs is not None else _exchange(wiring, enough)


def _signs(wiring: _Wiring, enough: float) -> SignGuess | None:
    """The fewest joints that, turned round, leave little enough."""
    n = wiring.tree.n
    for count in range(1, (n if n <= ALL_PATTERNS else MOST_TURNED) + 1):
        patterns = [_turned(n, which) for which in combinations(range(n), count)]
        found = [signs for signs in patterns if wiring.left(signs) < enough]
        if found:
            return SignGuess(found[0], tuple(found[1:]), by_torques=True)
    return None


def _exchange(wiring: _Wiring, enough: float) -> Exchange | None:
    """The exchange that leaves least, if that is little enough."""
    if wiring.tree.n > MOST_JOINTS:
        return None
    tried = {exchange: wiring.left(exchanged=exchange) for exchange in _exchanges(wiring.tree)}
    best = min(tried, key=lambda exchange: tried[exchange], default=None)
    return best if best is not None and tried[best] < enough else None


@dataclass(frozen=True)
class _Wiring:
    """A recording, asked how well other wirings explain it; arguments as of `wiring_by_torques`."""

    tree: RigidTree
    encoder: Stream
    command: Stream
    held: bool

    def left(self, signs: Signs = (), exchanged: Exchange | None = None) -> float:
        """Root mean square share of the torques that is left; infinite where a value would be impossible."""
        q, u = self.encoder, self.command
        order = list(range(self.tree.n))
        if exchanged is not None:
            i, j = (self.tree.joints.index(joint) for joint in exchanged.joints)
            order[i], order[j] = j, i
            q = q.exchanged(order) if POSITIONS in exchanged.columns else q
            u = u.exchanged(order) if COMMANDS in exchanged.columns else u
        q = replace(q, values=q.values * np.array(signs)) if signs else q
        equations = equations_of(self.tree, q, u, self.held)
        return open_share(equations) if all(map(_is_possible, equations)) else np.inf


def _is_possible(equation: DriveEquation) -> bool:
    """Whether the recording tells a constant, and nothing that is surely below zero."""
    values = equation.solve()
    given = {} if GAIN in values else {GAIN: np.sign(equation.direction().value) or 1.0}
    values = values or equation.solve(given)
    return bool(values) and not is_impossible(values)


def _turned(n: int, which: Sequence[int]) -> Signs:
    return tuple(-1.0 if j in which else 1.0 for j in range(n))


def _exchanges(tree: RigidTree) -> Iterator[Exchange]:
    """All pairs of joints of one kind, and what of them may be exchanged."""
    for pair in combinations(tree.joints, 2):
        if len({joint in tree.slides for joint in pair}) == 1:
            yield from (Exchange(pair, columns) for columns in ((POSITIONS, COMMANDS), (POSITIONS,), (COMMANDS,)))
