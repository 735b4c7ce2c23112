# SPDX-License-Identifier: BSD-3-Clause
"""Poses from a table (CSV): one row per pose and target, with angles of the joints and its place, or its contact.

Columns: `pose`, a name for each joint (its own, its ending, or q1, q2, ...), `x`, `y`, `z` or `contact`, and where they
are there `JOINT.torque` (or tau1, tau2, ...), `target`, `qx`, `qy`, `qz`, `qw`, and `place`, which contacts of a known
distance share.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.geometry.rotations import quaternion_xyzw
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses, Sighting
from jointscope.robots.recordings.recording import Notice
from jointscope.robots.units import si_factor
from jointscope.tools.bags.at_poses.table import Table
from jointscope.tools.bags.at_poses.target_rows import QUATERNION, by_pose, orientations, quaternions, target_names

Array = NDArray[np.float64]
AXES = ("x", "y", "z")


def poses_from_table(path: Path, robot: Robot) -> Poses:
    """The poses of a table.

    Raises:
        RecordingError: a column is missing, or a cell is no number.
    """
    setup = robot.poses
    assert setup is not None
    table = Table.read(path, "pose")
    head, body = table.head, table.body
    joints = [_joint_column(path, head, joint, i) for i, joint in enumerate(robot.joints)]
    if len(set(joints)) < len(joints):
        raise RecordingError(
            f"{path}: two joints would have the same column; name the columns {', '.join(robot.joints)}"
        )
    q = table.numbers(joints) * setup.joint_states.factor
    torques = [_torque_column(head, joint, i) for i, joint in enumerate(robot.joints)]
    tau = None if None in torques else table.numbers([t for t in torques if t is not None])
    names = tuple(table.words("pose")) if "pose" in head else tuple(map(str, range(len(body))))
    digest = hashlib.sha256(table.text.encode()).hexdigest()
    if "contact" in head:
        contacts = tuple(table.words("contact"))
        if "" in contacts:
            raise RecordingError(
                f"{path}: line {contacts.index('') + 2}, column contact: expected the name of the contact that "
                "holds the target, got nothing; name it, or remove the pose"
            )
        places = tuple(table.words("place")) if "place" in head else contacts
        pairs = tuple(dict.fromkeys(zip(contacts, places, strict=True)))
        unused = () if setup.contact_distance is None else _unused_distance(path, pairs)
        notices = (*_same_names(path, names), *unused)
        held = target_names(path, head, body, robot)
        return Poses(str(path), digest, names, q, None, contacts, pairs, tau, notices, held=held)
    missing = [axis for axis in AXES if axis not in head]
    if missing:
        raise RecordingError(
            f"{path}: no column {missing[0]!r}; expected x, y, z of the target, or `contact`; there are "
            f"{', '.join(head)}"
        )
    target = table.numbers([head.index(axis) for axis in AXES]) * si_factor(setup.positions.unit)
    _must_differ(path, np.hstack([q, target]))
    found = Poses(str(path), digest, names, q, target, torque=tau)
    return _with_targets(path, found, head, body, robot)


def _with_targets(path: Path, rows: Poses, head: Sequence[str], body: Sequence[Sequence[str]], robot: Robot) -> Poses:
    """Rows with measured places as poses, with the orientations that were measured."""
    assert robot.poses is not None
    targets, xyzw, notices = target_names(path, head, body, robot), quaternions(path, head, body), list[Notice]()
    if xyzw is not None:
        turns, owner = np.full((len(body), 3, 3), np.nan), np.array(targets or [robot.poses.link] * len(body))
        for target in dict.fromkeys(owner.tolist()):
            mine = np.flatnonzero(owner == target)
            found = orientations(path, xyzw[mine], [f"line {i + 2}" for i in mine], target)
            turns[mine] = np.nan if found.turns is None else found.turns
            notices += found.notices
        rows = replace(rows, turn=turns if np.any(np.isfinite(turns)) else None)
    if targets:
        rows = by_pose(rows, targets, [target.name for target in robot.poses.targets], "pose" in head)
    return replace(rows, notices=(*notices, *_same_names(path, rows.names)))


def _same_names(path: Path, names: Sequence[str]) -> tuple[Notice, ...]:
    """Rows of one name count as poses of their own, and are left out together when an effect is judged."""
    again = {name: count for name, count in Counter(names).items() if count > 1}
    if not again:
        return ()
    first = next(iter(again))
    text = (
        f"{path}: {sum(again.values())} of {len(names)} rows share their name in the column `pose` with another one, "
        f"as {again[first]} rows named {first}: each counts as a pose of its own; give each a name if they are"
    )
    return (Notice("poses", "info", sum(again.values()), text),)


def _must_differ(path: Path, rows: Array) -> None:
    """No measured target has the noise of another: such a row was copied."""
    _, first, which = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    earlier = first[which.ravel()]
    again = np.flatnonzero(earlier != np.arange(len(rows)))
    if len(again):
        raise RecordingError(
            f"{path}: line {again[0] + 2} repeats line {earlier[again[0]] + 2} to the last digit, {len(again)} of "
            f"{len(rows)} poses in all do so; give every pose once, or it counts twice"
        )


def _unused_distance(path: Path, pairs: Sequence[tuple[str, str]]) -> tuple[Notice, ...]:
    """A known distance needs places with two contacts; one contact alone has none, three have three."""
    by_place = Counter(place for _, place in pairs)
    many = next((place for place, count in by_place.items() if count > 2), None)
    if many is not None:
        raise RecordingError(
            f"{path}: place {many} has {by_place[many]} contacts; expected two, which are `contact_distance` of the "
            "robot file apart; give each pair a place of its own in the column `place`, or leave out `contact_distance`"
        )
    if 2 in by_place.values():
        return ()
    text = f"{path}: no place has two contacts, so `contact_distance` is not used; name places in a column `place`"
    return (Notice("poses", "info", len(pairs), text),)


def _joint_column(path: Path, head: Sequence[str], joint: str, place: int) -> int:
    """The column of a joint: by its name, by a name that ends it, or by its number."""
    for name in (joint, f"q{place + 1}"):
        if name in head:
            return head.index(name)
    ends = [i for i, name in enumerate(head) if name and joint.endswith(name)]
    if len(ends) == 1:
        return ends[0]
    raise RecordingError(f"{path}: no column of {joint}; expected {joint} or q{place + 1}, there are {', '.join(head)}")


def _torque_column(head: Sequence[str], joint: str, place: int) -> int | None:
    return next((head.index(n) for n in (f"{joint}.torque", f"tau{place + 1}") if n in head), None)


def pose_table(poses: Poses, robot: Robot) -> str:
    """Poses with measured targets as the text of a table [rad, N m, m]; a row for each pose and target."""
    assert poses.target is not None and robot.poses is not None
    torque = [f"{joint}.torque" for joint in robot.joints] if poses.torque is not None else []
    seen = (Sighting(robot.poses.link, poses.target, poses.turn), *poses.others)
    oriented = list(QUATERNION) if any(s.turn is not None for s in seen) else []
    lines = [",".join(["pose", *robot.joints, *torque, *["target"] * bool(poses.others), *AXES, *oriented])]
    for i, name in enumerate(poses.names):
        tau = [] if poses.torque is None else poses.torque[i].tolist()
        angles = [f"{x:.9f}" for x in poses.q[i]] + [f"{x:.4f}" for x in tau]
        for s in seen:
            if np.isfinite(s.place[i, 0]):
                cells = [*[s.name] * bool(poses.others), *(f"{x:.7f}" for x in s.place[i])]
                lines.append(",".join([name, *angles, *cells, *(_quaternion(s.turn, i) if oriented else [])]))
    return "\n".join(lines) + "\n"


def _quaternion(turns: Array | None, pose: int) -> list[str]:
    """Cells of an orientation; empty where none was measured."""
    if turns is None or not np.isfinite(turns[pose, 0, 0]):
        return [""] * len(QUATERNION)
    return [f"{x:.9f}" for x in quaternion_xyzw(turns[pose]).tolist()]
