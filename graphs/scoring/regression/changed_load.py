# SPDX-License-Identifier: BSD-3-Clause
"""A part of a recording in which a robot carries something else, or something pushes on it all the time.

Beside the drive of each joint stand, in that part alone, the mass and the first moments of the outermost link, or a
torque that stays. Its ends are where they leave least open at all joints together. No value of such a recording is
right: constants, inertias and friction are told by two robots at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.regression.evidence import beyond, evidence, nearly
from jointscope.graphs.scoring.regression.joint_regression import JointRows, fit
from jointscope.graphs.scoring.wrong_masses import EFFECT
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue

Array = NDArray[np.float64]
Columns = list[list[Array]]  # of each recording

WIDTHS = (0.24, 0.12, 0.06)  # [s] of windows; the widest of which a joint that reverses often has enough
PARTS = 20  # of each recording, of which a stretch is made first
REFINED = 4  # rounds between the neighbours of the best ends
BETWEEN = 9  # times around each of them
EDGE = 0.1  # share of a recording at either end within which nothing is told
LEFT = 0.25  # of the mean square that the plain regression leaves, which may be left ...
THAN_ALWAYS = 0.5  # ... and of what is left where the same acts all the time
FEWEST = 6  # windows in the stretch and beside it for each size: fewer may be reversals or steps of a counter
LARGE = 0.01  # of the drive's rms torque
ENDS = 2  # of a stretch, which are looked for
BY_CHANCE = 1e-4  # probability that a stretch need not be more plausible than


@dataclass(frozen=True)
class ChangedLoad:
    """A stretch in which something else acts than in the rest.

    Attributes:
        path: of the recording.
        start, stop: of the stretch; one of them an end of the recording where the change stays [s].
        end: of the recording [s].
        joint: whose torque shows it most clearly.
        size: rms of the torque that comes with it there, over that of its drive.
        left: share of the mean square there that the plain regression leaves beyond the noise of the encoders.
        push: torque on that joint, where it stays the same while the joint moves [N m]; zero for a load.
        evidence: for it, over all joints.
        nearly: how much less of it another cause may have that is as good.
    """

    path: str
    start: float
    stop: float
    end: float
    joint: str
    size: float
    left: float
    push: float = 0.0
    evidence: float = 0.0
    nearly: float = 0.0


class _Stretch(NamedTuple):
    """Sum of logarithms of what is left at all joints, and the stretch with which it is."""

    total: float
    recording: int
    start: float
    stop: float


def changed_load(rows: JointRows, paths: Sequence[str]) -> ChangedLoad | None:
    """The stretch with another load, or with a push, that explains most; None where none explains nearly all.

    Args:
        rows: of the regression.
        paths: of its recordings.
    """
    joints = [joint for joint in range(rows.robot.n) if _width(rows, joint) is not None]
    if not joints:
        return None
    push = _Search(rows, {joint: rows.constant() for joint in joints})
    load = _Search(rows, _of_load(rows, joints))
    pushed = push.change(push.best(), paths, push=True)
    loaded = load.change(load.best(), paths, push=False) if load.joints else None
    if pushed is None or loaded is None:
        return pushed or loaded
    return pushed if pushed.evidence >= loaded.evidence - loaded.nearly else loaded  # a push is simpler


def _width(rows: JointRows, joint: int) -> float | None:
    return next((width for width in WIDTHS if rows.of(joint, width) is not None), None)


def _of_load(rows: JointRows, joints: Sequence[int]) -> dict[int, Columns]:
    """Columns of the mass and the first moments of the outermost link, of the joints that it acts on."""
    robot, effect = rows.robot, catalogue()[EFFECT]
    owners = effect.owners_of(robot)  # none where no link has a mass
    if not np.any(robot.tree.gravity) or not owners:
        return {}
    load = EffectHypothesis(EffectAt(effect, owners[-1]), effect.parameters_at(robot, owners[-1]))
    found = {joint: rows.columns(joint, load) for joint in joints}
    return {joint: columns for joint, columns in found.items() if columns is not None}


class _Search:
    """What is left open where something acts in a stretch of one recording.

    Args:
        rows: of the regression.
        columns: of what acts, by joint.
    """

    def __init__(self, rows: JointRows, columns: dict[int, Columns]):
        self._rows, self._columns, self.joints = rows, columns, list(columns)
        self._plain, self._always, self._driving, self._width = {}, {}, {}, {}
        for joint, acting in columns.items():
            width = _width(rows, joint)
            assert width is not None
            here, always = rows.of(joint, width), rows.beside(joint, width, rows.with_own(joint, acting))
            assert here is not None and always is not None
            self._width[joint] = width
            self._plain[joint] = max(fit(rows.robot, joint, here).left, 1e-300)
            self._always[joint] = fit(rows.robot, joint, always[0]).left
            self._driving[joint] = float(np.mean(here[:, 0] ** 2))

    def best(self) -> _Stretch:
        """The stretch with which least is left."""
        return min(self._best(i, *span) for i, span in enumerate(self._rows.spans()))

    def _best(self, recording: int, begin: float, end: float) -> _Stretch:
        inner, step = EDGE * (end - begin), (end - begin) / PARTS
        inside = np.linspace(begin + inner, end - inner, PARTS - 1)
        first = self._among(recording, [begin, *inside], [*inside, end])
        tried = [(first.start, first.stop)]
        if first.start == begin or first.stop == end:  # in the one part less is nearly as in the other one more
            tried.append((first.stop, end) if first.start == begin else (begin, first.start))
        found = [first]
        for start, stop in tried:
            width = step
            for _ in range(REFINED):
                around = np.linspace(-width, width, BETWEEN)
                starts = [begin] if start == begin else [*np.clip(start + around, begin + inner, end - inner)]
                stops = [end] if stop == end else [*np.clip(stop + around, begin + inner, end - inner)]
                found.append(self._among(recording, starts, stops))
                _, _, start, stop = found[-1]
                width = 2.0 * width / (BETWEEN - 1)
        return min(found)

    def _among(self, recording: int, starts: Sequence[float], stops: Sequence[float]) -> _Stretch:
        """The best of stretches with some starts and stops."""
        edges = np.unique([*starts, *stops])
        pairs = [(a, b) for a in starts for b in stops if a < b and (a > edges[0] or b < edges[-1] or len(edges) == 2)]
        places = [(int(np.searchsorted(edges, a)), int(np.searchsorted(edges, b))) for a, b in pairs]
        sums = np.zeros(len(pairs))
        for joint in self.joints:
            parts = self._parts(joint, recording, edges)
            sums += [np.log(self._left(joint, parts, a, b)) for a, b in places]
        k = int(np.argmin(sums))
        return _Stretch(float(sums[k]), recording, *map(float, pairs[k]))

    def _parts(self, joint: int, recording: int, edges: Array) -> Array:
        """Rows of the regression with the columns in each part between two edges, shape (w, 5 + e + parts k)."""
        times, columns = self._rows.times(recording), self._columns[joint]
        flags = [(times >= a) & (times < b) for a, b in pairwise(edges)]
        acting = [
            [column * (flag if i == recording else 0.0) for flag in flags for column in own]
            for i, own in enumerate(columns)
        ]
        found = self._rows.beside(joint, self._width[joint], self._rows.with_own(joint, acting))
        assert found is not None
        return found[0]

    def _left(self, joint: int, parts: Array, a: int, b: int) -> float:
        """Share of the mean square that the plain regression leaves, with what acts in the parts from a to b."""
        return max(fit(self._rows.robot, joint, self._acting(joint, parts, a, b)).left / self._plain[joint], 1e-12)

    def _acting(self, joint: int, parts: Array, a: int, b: int) -> Array:
        count = len(self._columns[joint][0])
        before = 5 + self._rows.own_count(joint)
        cells = parts[:, before:].reshape(len(parts), -1, count)[:, a:b].sum(axis=1)
        return np.hstack([parts[:, :before], cells])

    def change(self, stretch: _Stretch, paths: Sequence[str], push: bool) -> ChangedLoad | None:
        """What is told of a stretch; None where it does not explain nearly all, or something that always acts does."""
        edges, shares, told, torques = np.array([stretch.start, stretch.stop]), dict[int, float](), [], {}
        worth, opens, seconds = 0.0, dict[int, float](), dict[int, float]()
        for joint in self.joints:
            parts, plain, width = self._parts(joint, stretch.recording, edges), self._plain[joint], self._width[joint]
            found = fit(self._rows.robot, joint, self._acting(joint, parts, 0, 1))
            seconds[joint] = self._rows.seconds(width, len(parts))
            noise = self._rows.noise(joint, width, found)
            left, opens[joint] = beyond(found.left, plain, noise)
            shares[joint], torques[joint] = left / max(opens[joint], 1e-300), float(found.more[-1] * found.gain)
            # each joint has sizes of its own, and one at which nothing acts needs none
            worth += max(evidence(plain, found.left, seconds[joint], len(self._columns[joint][0])), 0.0)
            if left < THAN_ALWAYS * beyond(found.left, self._always[joint], noise)[1]:
                told.append(joint)
        worth += evidence(1.0, 1.0, max(seconds.values()), ENDS)
        # a drive that gives nothing, as in a damaged recording, says how large nothing is
        told = [j for j in told if self._driving[j] > 0.0 and self._has_enough(j, stretch)]
        joint = min(told, key=lambda j: shares[j], default=-1)
        if joint < 0:
            return None
        size = float(np.sqrt(max(1.0 - shares[joint], 0.0) * opens[joint] / self._driving[joint]))
        if shares[joint] > LEFT or size < LARGE or worth < -np.log(BY_CHANCE):
            return None
        end, name = self._rows.spans()[stretch.recording][1], self._rows.robot.joints[joint]
        acted, path = -torques[joint] if push else 0.0, paths[stretch.recording]
        return ChangedLoad(
            path, stretch.start, stretch.stop, end, name, size, shares[joint], acted, worth, nearly(seconds[joint])
        )

    def _has_enough(self, joint: int, stretch: _Stretch) -> bool:
        """Whether there are windows enough for the sizes that are told, in a stretch and beside it."""
        flags = list[list[Array]]()
        for i in range(len(self._columns[joint])):
            times = self._rows.times(i)
            inside = (times >= stretch.start) & (times < stretch.stop) & (i == stretch.recording)
            flags.append([np.where(inside, 1.0, 0.0)])
        found = self._rows.beside(joint, self._width[joint], flags)
        assert found is not None
        count = int(np.count_nonzero(found[0][:, -1] > 0.5))
        return min(count, len(found[0]) - count) >= FEWEST * len(self._columns[joint][0])
