# SPDX-License-Identifier: BSD-3-Clause
"""What moved during a session: the tracker, a target on the tool, or the zero of an encoder.

A tracker that was moved shifts all that it measures from one pose on, in its own axes; a target that slipped is shifted
or turned from one pose on in axes of the tool; a coupling that slipped, or an encoder that lost counts, makes a joint
read more or less from one pose on. All are tried from every pose on, beside all values that were fitted, which imitate
most of a step. Of steps with different numbers of values, and a tracker that drifts, the Bayesian information criterion
chooses. Where poses fit badly for another reason, the others that were tried would seem to be steps, too: by what these
score on average beside the best one, that is less than it seems.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f

from jointscope.factors.calibration import Calibration
from jointscope.graphs.poses.linear_poses import LinearPoses
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.sagging_arm import in_tracker
from jointscope.graphs.poses.seen_targets import mounts

Array = NDArray[np.float64]
FEWEST = 4  # poses on each side of a step
CHANCE = 1e-4  # of a step where there is none
LARGEST = 1.0  # [m], [rad] of a step
FAR = 0.3  # [m], [rad] of a step that values at the end of a fit, where all was linearised, do not tell
NOTHING = 1e-9  # [sigma^2] that is left at least
MOSTLY = 0.75  # share of the poses at an end of a session that were left out, if a step is why


@dataclass(frozen=True)
class Step:
    """A step in what is left.

    Attributes:
        path: of the session.
        before, after: names of the poses between which it is; `before` is empty where it is all of the session.
        target: that moved on the tool; empty where all that was measured did.
        size: of the shift [m], or of the turn [rad]; of a joint how much more it reads, negative if less.
        turned: whether it is a turn.
        joint: whose zero moved; empty where something else did.
        mimic: what would look the same; of a target the link that carries it, "" for the tool.
    """

    path: str
    before: str
    after: str
    target: str
    size: float
    turned: bool
    joint: str = ""
    mimic: str = ""

    @property
    def text(self) -> str:
        """What moved where, and what to do."""
        since = f"From pose {self.after} of {self.path} on"
        if self.joint:
            more = "more" if self.size > 0.0 else "less"
            reads = f"{self.joint} reads {1e3 * abs(self.size):.2g} mrad {more}"
            if not self.before:
                return (
                    f"In all poses of {self.path} {reads} than in the other sessions: its coupling slipped or its "
                    "encoder was zeroed anew; calibrate with that session alone, or with the others"
                )
            return (
                f"{since} {reads}: its coupling slipped, its encoder "
                f"lost counts{self.mimic}, or poses of another kind begin there and an effect is missing; calibrate "
                f"with the poses up to {self.before} alone, or with the others"
            )
        if not self.target:
            return (
                f"{since} all targets are shifted by {1e3 * self.size:.2g} mm: the tracker, the base or the target was "
                f"moved; give poses up to {self.before} and the others as two tables, without `tracker` in the robot "
                "file"
            )
        how = f"{'turned' if self.turned else 'shifted'} on {self.mimic or 'the tool'} by {1e3 * self.size:.2g}"
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
    tries, first = list[_Try](), 0
    for problem, calibration in zip(problems, calibrations, strict=True):
        tracked = problem.poses.target is not None
        for shift in (*(_shifts(problem, calibration) if tracked else ()), *_jumps(problem, calibration)):
            tries += _tries(linear, problem, shift, first, bool(shift.joint) and len(problems) > 1)
        first += len(problem.poses)
    left = _left(linear)
    found = [(each, *each.scores(linear, left)) for each in tries if left.free > each.d]
    if not found:
        return None
    best, falls, steps = min(found, key=lambda each: _unlikely(linear, left, each[0].d, float(each[1].max())))
    i = int(np.argmax(falls))
    free, other = left.free - best.d, _beside(linear, best.columns[:, i])
    noise = max(1.0, (float(left.r @ left.r) - float(falls[i])) / free)
    rest, looks = _left(other), sum(len(each.starts) for each in tries)
    again = sum(float(each.scores(other, rest)[0].sum()) / each.d for each in tries) / looks
    again /= max(1.0, float(rest.r @ rest.r) / rest.free)
    score = float(falls[i]) / (noise * max(1.0, again))
    if (
        best.shift.drifts
        or float(np.linalg.norm(steps[i])) > FAR
        or f.sf(score / best.d, best.d, free) * looks >= CHANCE
    ):
        return None
    return best.step(i, steps[i])


def with_ends(problems: Sequence[PoseSet], whole: Sequence[PoseSet]) -> list[PoseSet]:
    """The sessions with those of the poses left out that are together at an end: they may fit but for a step.

    Args:
        problems: without poses that were left out.
        whole: with them.
    """
    return [_with_end(problem, all_of_it) for problem, all_of_it in zip(problems, whole, strict=True)]


def _with_end(problem: PoseSet, whole: PoseSet) -> PoseSet:
    kept = np.isin(whole.poses.shares, problem.poses.shares)
    back = kept.copy()
    for order in (slice(None), slice(None, None, -1)):
        out = np.cumsum(~kept[order]) / np.arange(1, len(kept) + 1)
        ends = np.flatnonzero(out >= MOSTLY)
        if len(ends) and ends[-1] + 1 >= FEWEST:
            back[order][: ends[-1] + 1] = True
    found = replace(problem, poses=whole.poses.only(back))
    return found if found.contacts == problem.contacts else problem


@dataclass(frozen=True)
class _Left:
    """What is left at the best values: rows r, shape (k m,) [sigma], and degrees of freedom."""

    r: Array
    free: float


def _left(linear: LinearPoses) -> _Left:
    """The poses may be at values of a fit to some of them."""
    information = linear.J.T @ linear.J + linear.tied
    r = linear.r - linear.J @ np.linalg.solve(information, linear.J.T @ linear.r + linear.pull)
    used = float(np.sum(linear.basis[: len(linear.r)] ** 2))
    return _Left(r, max(linear.counted - used, 1.0))


def _beside(linear: LinearPoses, columns: Array) -> LinearPoses:
    """The poses with the columns of a step among those of all values."""
    p, d = len(linear.tied), columns.shape[1]
    tied = np.eye(p + d) / LARGEST**2
    tied[:p, :p] = linear.tied
    return replace(linear, J=np.hstack([linear.J, columns]), tied=tied, pull=np.append(linear.pull, np.zeros(d)))


def _unlikely(linear: LinearPoses, left: _Left, d: int, fall: float) -> float:
    """Bayesian information criterion of a step of d values by which the sum of squares falls."""
    squares = max(float(left.r @ left.r) - fall, NOTHING)
    return linear.counted * float(np.log(squares)) + d * float(np.log(linear.counted))


@dataclass(frozen=True)
class _Shift:
    """What a shift or a turn would do to the rows of poses, shape (m, k, d); or a drift, which begins at once."""

    target: str
    turned: bool
    columns: Array
    joint: str = ""
    mimic: str = ""
    drifts: bool = False


@dataclass(frozen=True)
class _Try:
    """A shift from each of some poses on.

    Attributes:
        problem: the session.
        shift: what is shifted.
        starts: number in the session of the first pose that is shifted, shape (s,), and of the one before it.
        columns: whitened rows of all poses, shape (k m, s, d).
    """

    problem: PoseSet
    shift: _Shift
    starts: NDArray[np.intp]
    before: NDArray[np.intp]
    columns: Array

    @property
    def d(self) -> int:
        """Number of values of a step."""
        return self.columns.shape[2]

    def scores(self, linear: LinearPoses, left: _Left) -> tuple[Array, Array]:
        """By how much the sum of squares falls for each start, beside all values, shape (s,), and the steps, (s, d)."""
        wide = self.columns.reshape(len(self.columns), -1)
        g = (wide.T @ left.r).reshape(-1, self.d)
        beside = linear.beside(wide).reshape(-1, len(self.starts), self.d)
        H = np.einsum("rsi,rsj->sij", beside, beside) + np.eye(self.d) / LARGEST**2
        steps = np.linalg.solve(H, g[:, :, None])[:, :, 0]
        return np.einsum("si,si->s", steps, g), steps

    def step(self, i: int, size: Array) -> Step:
        """The step from one of the starts on."""
        poses, shift = self.problem.poses, self.shift
        length = float(size[0]) if shift.joint else float(np.linalg.norm(size))
        after = poses.names[self.starts[i]]
        before = "" if self.starts[i] == self.before[i] else poses.names[self.before[i]]
        return Step(poses.path, before, after, shift.target, length, shift.turned, shift.joint, shift.mimic)


def _tries(linear: LinearPoses, problem: PoseSet, shift: _Shift, first: int, whole: bool) -> list[_Try]:
    """A shift from every pose on; nothing where too few poses show it.

    Args:
        linear: all poses.
        problem: the session.
        shift: in its poses.
        first: number of its first pose among all.
        whole: whether it may be all of the session.
    """
    poses = np.flatnonzero(np.any(shift.columns, axis=(1, 2)))
    starts = poses[:1] if shift.drifts else poses[FEWEST : len(poses) - FEWEST + 1]
    if whole:
        starts = np.append(poses[:1], starts)
    if len(starts) == 0:
        return []
    m, k, d = shift.columns.shape
    after = np.arange(m)[:, None] >= starts
    wide = np.zeros((len(linear.groups), linear.rows, len(starts) * d))
    wide[first : first + m, :k] = (shift.columns[:, :, None] * after[:, None, :, None]).reshape(m, k, -1)
    before = poses[np.maximum(np.searchsorted(poses, starts) - 1, 0)]
    return [_Try(problem, shift, starts, before, linear.whitened(wide).reshape(-1, len(starts), d))]


def _jumps(problem: PoseSet, calibration: Calibration) -> Iterator[_Shift]:
    """Of the zero of each joint."""
    by_joint, joints = problem.point(calibration).by_joint, problem.arm.chain.joints
    for j, joint in enumerate(joints):
        mimic = ", the tracker or the base was turned about its axis" if j == 0 and not problem.contacts else ""
        mimic += ", the target slipped about its axis" if j == problem.arm.chain.level else ""
        yield _Shift("", True, by_joint[:, :, j : j + 1], joint, mimic)


def _shifts(problem: PoseSet, calibration: Calibration) -> Iterator[_Shift]:
    """Of all targets in axes of the tracker, at once or by and by, and of each on the tool."""
    values, seen = problem.values(calibration), problem.targets
    tool = problem.arm.at(problem.q, np.zeros_like(problem.q), values, True)
    tool = in_tracker(tool, problem.tracker, values, problem.poses.shares)
    m, mounted = len(tool.turn), mounts(problem.robot)
    assert problem.robot.poses is not None
    links = {t.name: t.link for t in problem.robot.poses.targets if mounted[t.name].joint is not None}
    there, owners = seen.there.reshape(m, -1, 3)[:, :, :1, None], seen.owners[::3]
    blocks = np.zeros((m, len(owners), 3, 3))
    turns = seen.turns[::3]
    blocks[:, ~turns] = np.eye(3)
    all_shifted = (there * blocks).reshape(m, -1, 3)
    yield _Shift("", False, all_shifted)
    yield _Shift("", False, problem.poses.shares[:, None, None] * all_shifted, drifts=True)
    for i, (target, turned) in enumerate(zip(owners, turns, strict=True)):
        blocks = np.zeros((m, len(owners), 3, 3))
        blocks[:, i] = mounted[target].on(tool).turn
        yield _Shift(target, bool(turned), (there * blocks).reshape(m, -1, 3), mimic=links.get(target, ""))
