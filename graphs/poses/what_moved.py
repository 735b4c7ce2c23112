# SPDX-License-Identifier: BSD-3-Clause
"""What moved during a session: the tracker, or a target on the tool.

A tracker that was moved shifts all that it measures from one pose on, in its own axes; a target that slipped is shifted
or turned from one pose on in axes of the tool. Both are tried from every pose on, beside all values that were fitted,
which imitate most of a step.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc

from jointscope.factors.calibration import Calibration
from jointscope.graphs.poses.linear_poses import LinearPoses
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.sagging_arm import in_tracker

Array = NDArray[np.float64]
FEWEST = 4  # poses on each side of a step
CHANCE = 1e-4  # of a step where there is none
LARGEST = 1.0  # [m], [rad] of a step


@dataclass(frozen=True)
class Step:
    """A step in what is left.

    Attributes:
        path: of the session.
        before, after: names of the poses between which it is.
        target: that moved on the tool; empty where all that was measured did.
        size: of the shift [m], or of the turn [rad].
        turned: whether it is a turn.
        surprise: logarithm of how likely it is by chance.
    """

    path: str
    before: str
    after: str
    target: str
    size: float
    turned: bool
    surprise: float

    @property
    def text(self) -> str:
        """What moved where, and what to do."""
        since = f"From pose {self.after} of {self.path} on"
        if not self.target:
            return (
                f"{since} all targets are shifted by {1e3 * self.size:.2g} mm: the tracker, the base or the target was "
                f"moved; give poses up to {self.before} and the others as two tables, without `tracker` in the robot "
                "file"
            )
        how = f"{'turned' if self.turned else 'shifted'} on the tool by {1e3 * self.size:.2g}"
        return (
            f"{since} the target {self.target} is {how} {'mrad' if self.turned else 'mm'}: it slipped, or poses of "
            "another kind begin there and an effect is missing; leave out its rows from there on, or up to "
            f"{self.before}"
        )


def what_moved(linear: LinearPoses, problems: Sequence[PoseSet], calibrations: Sequence[Calibration]) -> Step | None:
    """The clearest step of all sessions and targets; None where nothing moved.

    Args:
        linear: the poses at the values of a fit.
        problems: the sessions.
        calibrations: of each.
    """
    found, first = list[Step](), 0
    used = float(np.sum(linear.basis[: len(linear.r)] ** 2))
    noise = max(1.0, float(linear.r @ linear.r) / max(linear.counted - used, 1.0))
    for problem, calibration in zip(problems, calibrations, strict=True):
        parts = list(_shifts(problem, calibration)) if problem.poses.target is not None else []
        for part in parts:
            wide = np.zeros((len(linear.groups), linear.rows, 3))
            wide[first : first + len(problem.poses), : part.columns.shape[1]] = part.columns
            step = _clearest(linear, noise, problem, replace(part, columns=wide), first, len(parts))
            found += [] if step is None else [step]
        first += len(problem.poses)
    return min(found, key=lambda step: step.surprise, default=None)


@dataclass(frozen=True)
class _Shift:
    """What a shift or a turn would do to the rows of poses, shape (m, k, 3)."""

    target: str
    turned: bool
    columns: Array


def _shifts(problem: PoseSet, calibration: Calibration) -> Iterator[_Shift]:
    """Of all targets in axes of the tracker, and of each on the tool."""
    values, seen = problem.values(calibration), problem.targets
    tool = problem.arm.at(problem.q, np.zeros_like(problem.q), values)
    R = in_tracker(tool, problem.tracker, values, problem.poses.shares).turn
    there, owners = seen.there.reshape(len(R), -1, 3)[:, :, :1, None], seen.owners[::3]
    blocks = np.zeros((len(R), len(owners), 3, 3))
    turns = seen.turns[::3]
    blocks[:, ~turns] = np.eye(3)
    yield _Shift("", False, (there * blocks).reshape(len(R), -1, 3))
    for i, (target, turned) in enumerate(zip(owners, turns, strict=True)):
        blocks = np.zeros((len(R), len(owners), 3, 3))
        blocks[:, i] = R
        yield _Shift(target, bool(turned), (there * blocks).reshape(len(R), -1, 3))


def _clearest(
    linear: LinearPoses, noise: float, problem: PoseSet, shift: _Shift, first: int, tried: int
) -> Step | None:
    """The best step of a shift, if it is none by chance: its score beside all values that were fitted.

    Args:
        linear: the poses.
        noise: power of what is left [sigma^2].
        problem: the session.
        shift: its columns for all poses.
        first: number of the first pose of the session.
        tried: how many shifts are looked at.
    """
    poses = np.flatnonzero(np.any(shift.columns, axis=(1, 2)))
    starts = poses[FEWEST : len(poses) - FEWEST + 1]
    if len(starts) == 0:
        return None
    after = np.arange(len(shift.columns))[:, None] >= starts
    columns = linear.whitened(
        (shift.columns[:, :, None] * after[:, None, :, None]).reshape(*shift.columns.shape[:2], -1)
    )
    g = (columns.T @ linear.r).reshape(-1, 3)
    beside = linear.beside(columns).reshape(-1, len(starts), 3)
    H = np.einsum("rsi,rsj->sij", beside, beside) + np.eye(3) / LARGEST**2
    steps = np.linalg.solve(H, g[:, :, None])[:, :, 0]
    scores = np.einsum("si,si->s", steps, g) / noise
    best = int(np.argmax(scores))
    if gammaincc(1.5, scores[best] / 2.0) * len(starts) * tried >= CHANCE:
        return None
    at, names = int(starts[best]), problem.poses.names
    before = int(poses[np.searchsorted(poses, at) - 1])
    size = float(np.linalg.norm(steps[best]))
    path = problem.poses.path
    return Step(path, names[before - first], names[at - first], shift.target, size, shift.turned, -float(scores[best]))
