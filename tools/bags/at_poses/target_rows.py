# SPDX-License-Identifier: BSD-3-Clause
"""Rows of a table of poses put together: one row for each pose and target, and how the target is oriented there.

Columns: `target`, which may be empty for the first one, and `qx, qy, qz, qw` of the orientation of the target in the
axes of the tracker, which may be empty where it was not measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.geometry.rotations import of_quaternions
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses, Sighting
from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted

Array = NDArray[np.float64]
QUATERNION = ("qx", "qy", "qz", "qw")
UNIT = 1e-3  # that the norm of a quaternion may be off
SAME = 1e-9  # of a quaternion that never changes
ALIKE = 1e-3  # [rad] that angles of one pose may differ from row to row


@dataclass(frozen=True)
class Orientations:
    """Quaternions x, y, z, w of s sightings as the columns of rotations.

    Attributes:
        turns: R_tracker_target, shape (s, 3, 3), not a number where none was measured.
        notices: what was left out.
    """

    turns: Array | None
    notices: tuple[Notice, ...] = ()


def orientations(path: Path | str, xyzw: Array, places: Sequence[str], target: str) -> Orientations:
    """Rotations of quaternions; none where the tracker gives none.

    Args:
        path: where they come from.
        xyzw: shape (s, 4), not a number where there is none.
        places: what to call each, as "line 4".
        target: name of the target.

    Raises:
        RecordingError: one is no rotation.
    """
    norm = np.linalg.norm(xyzw, axis=1)
    zero, there = norm == 0.0, np.isfinite(norm) & (norm > 0.0)
    if not np.any(there):
        text = f"{path}: the tracker gives no orientation of {target} (all are zero); none is used"
        return Orientations(None, (Notice("poses", "info", int(zero.sum()), text),) if np.any(zero) else ())
    wrong = np.flatnonzero(there & (np.abs(norm - 1.0) > UNIT))
    if len(wrong):
        raise RecordingError(
            f"{path}: {places[wrong[0]]}: the quaternion of {target} has norm {norm[wrong[0]]:.4g}; expected 1, in the "
            "order x, y, z, w: other columns, angles instead of a quaternion, or digits that were cut off"
        )
    first = xyzw[there][0]
    if np.count_nonzero(there) > 1 and np.abs(xyzw[there] - first).max() < SAME:
        what = "the identity" if abs(first[3]) > 1.0 - SAME else "the same"
        text = f"{path}: the orientation of {target} is {what} in all poses, as if the tracker gave none; not used"
        return Orientations(None, (Notice("poses", "info", int(there.sum()), text),))
    turns = of_quaternions(xyzw / np.where(there, norm, np.nan)[:, None])
    text = f"{path}: {counted(int(zero.sum()), 'orientation')} of {target} all zero: not measured there"
    return Orientations(turns, (Notice("poses", "info", int(zero.sum()), text),) if np.any(zero) else ())


def quaternions(path: Path, head: Sequence[str], body: Sequence[Sequence[str]]) -> Array | None:
    """Of each row, shape (s, 4), x, y, z, w, not a number where the cells are empty; None of a table without them.

    Raises:
        RecordingError: some of the columns are missing, some cells are empty, or one is no number.
    """
    missing = [name for name in QUATERNION if name not in head]
    if len(missing) == len(QUATERNION):
        return None
    if missing:
        raise RecordingError(
            f"{path}: no column {missing[0]!r}; expected all of {', '.join(QUATERNION)}, or none of them"
        )
    columns, found = [head.index(name) for name in QUATERNION], np.full((len(body), 4), np.nan)
    for i, row in enumerate(body):
        cells = [row[column].strip() for column in columns]
        if not any(cells):
            continue
        try:
            found[i] = [float(cell) for cell in cells]
        except ValueError:
            found[i] = np.nan
        if not np.all(np.isfinite(found[i])):
            raise RecordingError(
                f"{path}: line {i + 2}: expected four numbers in {', '.join(QUATERNION)}, or none where no orientation "
                f"was measured, got {', '.join(map(repr, cells))}"
            )
    return found


def target_names(path: Path, head: Sequence[str], body: Sequence[Sequence[str]], robot: Robot) -> tuple[str, ...]:
    """Name of the target of each row; empty where the table or the robot has but one.

    Raises:
        RecordingError: a target that the robot file does not know.
    """
    setup = robot.poses
    assert setup is not None
    first, *others = (target.name for target in setup.targets)
    if "target" not in head:
        return ()
    names = [row[head.index("target")].strip() for row in body]
    if not others and len(set(names)) < 2:
        return ()
    names = [name or first for name in names]
    strange = [name for name in dict.fromkeys(names) if name not in (first, *others)]
    if strange:
        raise RecordingError(
            f"{path}: the targets {', '.join(strange)} are none of {robot.path.name}, which has "
            f"{', '.join((first, *others))}; name them in its section poses, as `targets: {{{strange[0]}: {{}}}}`, and "
            "their places on the tool are found"
        )
    return tuple(names)


def by_pose(rows: Poses, names: Sequence[str], known: Sequence[str], has_names: bool) -> Poses:
    """Rows of one target each as poses of all that was seen in them.

    Args:
        rows: a row as a pose.
        names: target of each row.
        known: names of the targets of the robot file, in its order.
        has_names: whether the table has names of poses.

    Raises:
        RecordingError: a pose has the same target twice, or other angles.
    """
    if not has_names:
        raise RecordingError(
            f"{rows.path}: a row for each target needs a column `pose`, which says which rows belong together"
        )
    poses = list(dict.fromkeys(rows.names))
    of_row = np.array([poses.index(name) for name in rows.names])
    seen = {target: np.flatnonzero(np.array(names) == target) for target in dict.fromkeys(names)}
    for target, mine in seen.items():
        numbers, count = np.unique(of_row[mine], return_counts=True)
        if np.any(count > 1):
            raise RecordingError(
                f"{rows.path}: pose {poses[numbers[count > 1][0]]} has {count.max()} rows of the target {target}; "
                "expected one row for each pose and target: give every pose a name of its own"
            )
    start = np.array([int(np.flatnonzero(of_row == i)[0]) for i in range(len(poses))])
    away = np.abs(rows.q - rows.q[start][of_row]).max(axis=1)
    if away.max() > ALIKE:
        odd = int(np.argmax(away))
        raise RecordingError(
            f"{rows.path}: line {odd + 2}: pose {rows.names[odd]} has other angles in line {start[of_row[odd]] + 2}, "
            f"by {away[odd]:.2g} rad; expected the same angles in all rows of a pose: give every pose a name of its own"
        )
    found = []
    assert rows.target is not None
    for target in (name for i, name in enumerate(known) if not i or name in seen):
        place, turn = np.full((len(poses), 3), np.nan), np.full((len(poses), 3, 3), np.nan)
        mine = seen.get(target, np.zeros(0, int))
        place[of_row[mine]] = rows.target[mine]
        if rows.turn is not None:
            turn[of_row[mine]] = rows.turn[mine]
        found.append(Sighting(target, place, turn if np.any(np.isfinite(turn)) else None))
    main, *others = found
    torque = None if rows.torque is None else rows.torque[start]
    return replace(
        rows,
        names=tuple(poses),
        q=rows.q[start],
        target=main.place,
        turn=main.turn,
        others=tuple(others),
        torque=torque,
    )
