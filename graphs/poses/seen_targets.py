# SPDX-License-Identifier: BSD-3-Clause
"""What was seen of the tool in each pose, as rows: places of its targets, then turns of those that show theirs.

    p_i = p_1 + R (a_i + l_i - a_1 - l_1),    R_i = R M_i Ry(mis_y) Rx(mis_x) Rz(offset)
    rows: p_i - p_measured and Log(R_i R_measured')

R turns the link of the first target; a_i and M_i, where target i sits on the tool, are in its axes, l_i and the angles
are errors of that. The tool is one body: whatever moves the first target by v and turns the tool by w moves target i by
v + w x (p_i - p_1). A target on another link of the arm hangs on the origin of that link in the same way (a_1 = l_1 =
0): joints behind it move it only as their weight does. Rows of a target that was not seen are zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.poses.sagging_arm import SaggingPoint
from jointscope.robots.bodies.misplaced_joints import ANGLES, LENGTHS, across, turned
from jointscope.robots.errors import RecordingError
from jointscope.robots.geometry.arm_chain import ArmChain, cross
from jointscope.robots.geometry.error_parameters import TOOL
from jointscope.robots.geometry.rotations import log_slopes, rotation_vectors
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses, Sighting

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Block = tuple[Array, Array, dict[str, Array]]
"""Three rows of each pose, shape (m, 3), by the joints, shape (m, 3, n), and by values, shape (m, 3)."""


@dataclass(frozen=True)
class Mount:
    """Where a target is mounted.

    Attributes:
        owner: of its errors.
        R_link: R_tool_link; of a target on another link, the axes of that link in those of its joint.
        R_target: R_link_target.
        at: its place in axes of the tool, or from the origin of the joint before its link, shape (3,) [m].
        joint: number of that joint in the chain; None of a target on the tool.
    """

    owner: str
    R_link: Array
    R_target: Array
    at: Array
    joint: int | None = None

    def place(self, values: Mapping[str, float]) -> Array:
        """In the axes of what carries it, shape (3,) [m]."""
        return np.asarray(self.at + self.R_link @ [values.get(f"{self.owner}.{part}", 0.0) for part in LENGTHS])

    def on(self, point: SaggingPoint) -> SaggingPoint:
        """What carries it: the tool with the first target, or another link with its origin."""
        return point if self.joint is None else point.others[self.joint]

    def away(self, first: Mount, values: Mapping[str, float]) -> Array:
        """From the target of what carries it, in its axes, shape (3,) [m].

        Args:
            first: mount of the first target.
            values: of all parameters.
        """
        return self.place(values) - (first.place(values) if self.joint is None else 0.0)


class SeenTargets:
    """Rows of some poses.

    Args:
        robot: with a section `poses`.
        poses: the poses.

    Attributes:
        first: name of the first target.
        plain: whether there is nothing but the place of the first target in every pose.
        sightings: of all targets that were seen, by their mount.
        there: which rows of which pose were measured, shape (m, k).
        turns: which of the k rows are turns.

    Raises:
        RecordingError: a target that the robot file does not know.
    """

    def __init__(self, robot: Robot, poses: Poses):
        self._mounts, self._poses = mounts(robot), poses
        self.first = first = next(iter(self._mounts))
        strange = next((s for s in (*(s.name for s in poses.others), *poses.held) if s and s not in self._mounts), None)
        if strange:
            raise RecordingError(
                f"{poses.path}: the target {strange!r} is none of {robot.path.name}, which has "
                f"{', '.join(self._mounts)}; add it to `targets` of the section poses"
            )
        self.held = np.array([list(self._mounts).index(name or first) for name in poses.held], dtype=int)
        own = [] if poses.target is None else [Sighting(first, poses.target, poses.turn)]
        self.sightings = [s for s in (*own, *poses.others) if np.any(np.isfinite(s.place))]
        self._turned = [s for s in self.sightings if s.turn is not None and np.any(np.isfinite(s.turn))]
        m, alone = len(poses), [s.name for s in self.sightings] == [first] and not self._turned
        self.plain = bool(alone and np.all(np.isfinite(self.sightings[0].place)))
        if poses.target is None:
            self.plain = not np.any(self.held)
        if self.plain or poses.target is None:
            self.there, self.turns = np.ones((m, 3), bool), np.zeros(3, bool)
            return
        seen: list[Mask] = [np.isfinite(s.place) for s in self.sightings]
        seen += [np.isfinite(s.turn[:, 0]) for s in self._turned if s.turn is not None]
        self.there = np.hstack(seen)
        self.turns = np.arange(self.there.shape[1]) >= 3 * len(self.sightings)

    @property
    def measured(self) -> Array:
        """What the rows are compared with, shape (m, k): places; turns are those from the measured orientation."""
        places = np.hstack([s.place for s in self.sightings])
        return np.hstack([np.where(np.isfinite(places), places, 0.0), np.zeros((len(places), int(self.turns.sum())))])

    def names_of(self, poses: NDArray[np.intp], which: NDArray[np.intp]) -> tuple[str, ...]:
        """Names of the targets of some rows: numbers of their poses and of their places in a pose, shape (s,) each."""
        if self._poses.target is not None:
            return tuple(self.sightings[i].name for i in which)
        names = list(self._mounts)
        return tuple(names[self.held[i] if len(self.held) else 0] for i in poses)

    @property
    def owners(self) -> tuple[str, ...]:
        """Name of the target of each of the k rows; that of the first one where contacts hold targets."""
        if self._poses.target is None:
            return (self.first,) * 3
        return tuple(s.name for s in (*self.sightings, *self._turned) for _ in range(3))

    def names_of_turns(self, which: NDArray[np.intp]) -> tuple[str, ...]:
        """Names of the targets of some turns by their places in a pose, shape (t,)."""
        return tuple(self._turned[i].name for i in which)

    def rows(self, point: SaggingPoint, values: Mapping[str, float]) -> SaggingPoint:
        """The rows that were measured, with their derivatives.

        Args:
            point: the first target and the tool, derivatives those of a body unless rows are plain.
            values: of all parameters.
        """
        if self.plain:
            return point
        if self._poses.target is None:
            return _together(point, [self._held(point, values)], self.there)
        blocks = [self._place(point, values, self._mounts[s.name]) for s in self.sightings]
        blocks += [_turn(point, values, self._mounts[s.name], s.turn) for s in self._turned if s.turn is not None]
        return _together(point, blocks, self.there)

    def _place(self, point: SaggingPoint, values: Mapping[str, float], mount: Mount) -> Block:
        first, point = next(iter(self._mounts.values())), mount.on(point)
        away = point.turn @ mount.away(first, values)
        axes = np.swapaxes(point.by_joint, 1, 2)
        by_joint = axes[:, :, :3] + cross(axes[:, :, 3:], away[:, None])
        by_value = {name: column[:, :3] + cross(column[:, 3:], away) for name, column in point.by_value.items()}
        if mount is not first:
            own = point.turn @ mount.R_link
            for k, part in enumerate(LENGTHS):
                if mount.joint is None:
                    by_value[f"{TOOL}.{part}"] = by_value[f"{TOOL}.{part}"] - point.turn[:, :, k]
                by_value[f"{mount.owner}.{part}"] = own[:, :, k]
        return point.target + away, np.swapaxes(by_joint, 1, 2), by_value

    def _held(self, point: SaggingPoint, values: Mapping[str, float]) -> Block:
        """The target that is in the contact, of each pose its own."""
        target, by_joint = np.zeros_like(point.target), np.zeros_like(point.by_joint[:, :3])
        by_value: dict[str, Array] = {}
        for i, mount in enumerate(self._mounts.values()):
            here = self.held == i
            if not np.any(here):
                continue
            place, joints, columns = self._place(point, values, mount)
            target[here], by_joint[here] = place[here], joints[here]
            for name, column in columns.items():
                by_value.setdefault(name, np.zeros_like(target))[here] = column[here]
        return target, by_joint, by_value


def mounts(robot: Robot) -> dict[str, Mount]:
    """Where the targets of a robot are on its tool and its links, by name; the first one first."""
    setup, tree = robot.poses, robot.tree
    assert setup is not None
    chain = ArmChain(tree, setup.link, setup.at, [target.link for target in setup.targets])
    frames = [tree.model.frames[tree.frame_id(target.link)].placement for target in setup.targets]
    found = {}
    for i, (target, frame, level) in enumerate(zip(setup.targets, frames, chain.levels, strict=True)):
        on_tool = level == chain.level
        T, at = frames[0].actInv(frame) if on_tool else frame, np.zeros(3) if target.at is None else target.at
        turn = np.eye(3) if target.turn is None else target.turn
        owner, place = target.name if i else TOOL, np.array(T.translation) + T.rotation @ at
        found[target.name] = Mount(owner, np.array(T.rotation), turn, place, None if on_tool else level)
    return found


def places_on(robot: Robot, point: SaggingPoint, values: Mapping[str, float]) -> dict[str, Array]:
    """Places of all targets of a robot, shape (m, 3) [m] each, in the axes that the arm is given in.

    Args:
        robot: with its targets.
        point: the arm at some poses, with the other links that carry targets.
        values: of all parameters.
    """
    found = mounts(robot)
    first = next(iter(found.values()))

    def place(mount: Mount) -> Array:
        link = mount.on(point)
        return np.asarray(link.target + link.turn @ mount.away(first, values))

    return {name: place(mount) for name, mount in found.items()}


def _turn(point: SaggingPoint, values: Mapping[str, float], mount: Mount, measured: Array) -> Block:
    """The turn from the measured orientation of a target to the predicted one."""
    point = mount.on(point)
    R, own = point.turn @ mount.R_link @ mount.R_target, {}
    along, x, y = across(np.array([0.0, 0.0, 1.0]))
    for part, axis in zip(ANGLES, (y, x, along), strict=True):
        own[f"{mount.owner}.{part}"] = R @ axis
        R = R @ turned(axis, np.array(values.get(f"{mount.owner}.{part}", 0.0)))
    seen = np.where(np.isfinite(measured), measured, R)
    r = rotation_vectors(R @ np.swapaxes(seen, 1, 2))
    J = log_slopes(r)
    by_value = {name: np.einsum("mij,mj->mi", J, column[:, 3:]) for name, column in point.by_value.items()}
    by_value |= {name: np.einsum("mij,mj->mi", J, axis) for name, axis in own.items()}
    return r, J @ point.by_joint[:, 3:], by_value


def _together(point: SaggingPoint, blocks: list[Block], mask: Mask) -> SaggingPoint:
    """Blocks of rows one below the other; zero where nothing was measured."""
    still, there = np.zeros((len(mask), 3)), mask.astype(np.float64)
    names = dict.fromkeys(name for _, _, by_value in blocks for name in by_value)
    by_value = {name: there * np.hstack([block[2].get(name, still) for block in blocks]) for name in names}
    by_joint = there[:, :, None] * np.concatenate([block[1] for block in blocks], axis=1)
    target = there * np.hstack([block[0] for block in blocks])
    return replace(point, target=target, by_joint=by_joint, by_value=by_value)
