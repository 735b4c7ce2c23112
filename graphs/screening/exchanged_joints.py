# SPDX-License-Identifier: BSD-3-Clause
"""Joints that have each other's commands or positions, where no gyroscope tells: the torques do.

With each other's columns inertias and weights couple with the wrong joint. Tried only where the regression leaves much,
or says what cannot be; believed where it leaves little then, with values that can be.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from jointscope.graphs.screening.open_share import equations_of, open_share
from jointscope.graphs.starts.drive_regression import GAIN, DriveEquation, is_impossible
from jointscope.graphs.starts.drive_starts import driven_joints
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Topic
from jointscope.robots.recordings.recording import Notice, Recording, Stream

EXCHANGED = "exchanged"  # kind of its notices
POOR = 0.03  # of the torque that a right wiring may leave; more is looked into
CLEARLY = 3.0  # times less that another wiring must leave
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

    @property
    def seen(self) -> str:
        """What was seen, in words."""
        a, b = self.joints
        return f"{' and '.join(self.columns)} of {a} and {b} seem to be exchanged: so the regression explains them"

    def sentence(self, robot: Robot) -> str:
        """What was seen, and what to write in the robot's file."""
        encoder = robot.motor_encoder
        places = {COMMANDS: ("command", robot.command), POSITIONS: (f"sensors.{encoder.name}", encoder.source)}
        lines = [
            f"`names: [{', '.join(self._names(robot.joints, topic))}]` in {place}"
            for place, topic in (places[columns] for columns in self.columns)
        ]
        file = robot_argument(robot)
        return f"{self.seen}; if that is so, write {' and '.join(lines)} of {file}, then calibrate"

    def _names(self, joints: Sequence[str], topic: Topic) -> list[str]:
        """The names of a topic in the order that mends it; of messages without names the places."""
        names = names_or_places(topic, len(joints))
        i, j = (joints.index(joint) for joint in self.joints)
        names[i], names[j] = names[j], names[i]
        return names


@dataclass(frozen=True)
class Wiring:
    """A recording, asked how well other wirings explain it.

    Attributes:
        tree: the robot, with masses.
        encoder: positions [rad or m].
        command: what drives the joints.
        held: whether a command acts until the next one.
    """

    tree: RigidTree
    encoder: Stream
    command: Stream
    held: bool

    def left(self, signs: Sequence[float] = (), exchanged: Exchange | None = None) -> float:
        """Root mean square share of the torques that is left; infinite where a value would be impossible.

        Args:
            signs: with which encoders count, one for each joint; none where as they do.
            exchanged: joints whose columns change places.
        """
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

    def enough(self) -> float:
        """How little another wiring must leave; zero where this one is good enough."""
        as_is = self.left()
        return 0.0 if as_is < POOR else min(POOR, as_is / CLEARLY)

    def exchange(self, enough: float) -> Exchange | None:
        """The exchange that leaves least, if that is less than some share."""
        if self.tree.n > MOST_JOINTS:
            return None
        tried = {exchange: self.left(exchanged=exchange) for exchange in _exchanges(self.tree)}
        best = min(tried, key=lambda exchange: tried[exchange], default=None)
        return best if best is not None and tried[best] < enough else None


def exchanged_joints(robot: Robot, recordings: Sequence[Recording]) -> list[Notice]:
    """A sentence about joints that have each other's columns; nothing where regression does not apply, or all is right.

    Args:
        robot: the model, as its file has it.
        recordings: of it, at least one.
    """
    rigid = not robot.layout.motors and robot.link_encoder is None and not robot.gyros and robot.transmission is None
    if robot.n == 1 or robot.free_links or not rigid:
        return []
    robot = robot.in_posture(recordings[0].posture)
    for driven in driven_joints(robot, recordings):
        wiring = Wiring(robot.tree, driven.encoder, driven.command, robot.command_held)
        enough = wiring.enough()
        found = wiring.exchange(enough) if enough else None
        if found is not None:
            return [Notice("command", EXCHANGED, len(driven.command), found.sentence(robot))]
    return []


def names_or_places(topic: Topic, count: int) -> list[str]:
    """The joints of a topic as `names` of a robot file has them; of messages without names the places."""
    return list(topic.names) or [f'"{place}"' for place in range(count)]


def _is_possible(equation: DriveEquation) -> bool:
    """Whether the recording tells a constant, and nothing that is surely below zero."""
    values = equation.solve()
    given = {} if GAIN in values else {GAIN: np.sign(equation.direction().value) or 1.0}
    values = values or equation.solve(given)
    return bool(values) and not is_impossible(values)


def _exchanges(tree: RigidTree) -> Iterator[Exchange]:
    """All pairs of joints of one kind, and what of them may be exchanged."""
    for pair in combinations(tree.joints, 2):
        if len({joint in tree.slides for joint in pair}) == 1:
            yield from (Exchange(pair, columns) for columns in ((POSITIONS, COMMANDS), (POSITIONS,), (COMMANDS,)))
