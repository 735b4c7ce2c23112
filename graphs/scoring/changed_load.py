# SPDX-License-Identifier: BSD-3-Clause
"""From when on a robot carries something else: a payload that is taken up, or set down, in the middle of a recording.

The mass and the first moments of an outermost link, from a time on, stand in the regression of each joint beside its
drive. The time is where they leave least open at all joints together. Neither value of such a recording is right:
constants, inertias and friction are told by two robots at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.joint_regression import JointRows, Since, fit
from jointscope.graphs.scoring.wrong_masses import EFFECT
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue

WIDTH = 0.24  # [s] of windows
TRIED = 17  # times of each recording, first
REFINED = 3  # rounds between the neighbours of the best
BETWEEN = 8  # times in each of them
EDGE = 0.1  # share of a recording at either end within which nothing is told
LEFT = 0.25  # of the mean square that the plain regression leaves, which may be left ...
THAN_ALWAYS = 0.5  # ... and of what is left where the load is another one all the time
LARGE = 0.01  # of the drive's rms torque


@dataclass(frozen=True)
class ChangedLoad:
    """When the load changes.

    Attributes:
        path: of the recording.
        time, end: of the change and the end of the recording [s].
        joint: whose torque shows it most clearly.
        size: rms of the torque that comes with it there, over that of its drive.
    """

    path: str
    time: float
    end: float
    joint: str
    size: float


def changed_load(rows: JointRows, paths: Sequence[str]) -> ChangedLoad | None:
    """The change of load that explains most; None where none explains nearly all that is missing somewhere.

    Args:
        rows: of the regression.
        paths: of its recordings.
    """
    robot, effect = rows.robot, catalogue()[EFFECT]
    owners = effect.owners_of(robot)  # none where no link has a mass
    if not np.any(robot.tree.gravity) or not owners:
        return None
    owner = owners[-1]
    load = EffectHypothesis(EffectAt(effect, owner), effect.parameters_at(robot, owner))
    joints = [joint for joint in range(robot.n) if rows.of(joint, WIDTH, load) is not None]
    search = _Search(rows, load, joints)
    found = [(search.best(i, *span), i, span) for i, span in enumerate(rows.spans())] if joints else []
    told = [(*one, span[1], paths[i]) for one, i, span in found]
    if not told:
        return None
    _, time, joint, left, size, end, path = min(told)
    return ChangedLoad(path, time, end, robot.joints[joint], size) if left < LEFT and size > LARGE else None


class _Search:
    """What is left open with another load from a time on.

    Args:
        rows: of the regression.
        load: the mass of the outermost link.
        joints: that it moves or weighs on.
    """

    def __init__(self, rows: JointRows, load: EffectHypothesis, joints: Sequence[int]):
        self._rows, self._load, self._joints = rows, load, joints
        self._plain, self._always, self._driving = {}, {}, {}
        for joint in joints:
            here, with_load = rows.of(joint, WIDTH), rows.of(joint, WIDTH, load)
            assert here is not None and with_load is not None
            self._plain[joint] = fit(rows.robot, joint, here).left
            self._always[joint] = fit(rows.robot, joint, with_load, load).left
            self._driving[joint] = float(np.mean(here[:, 0] ** 2))

    def best(self, recording: int, start: float, end: float) -> tuple[float, float, int, float, float]:
        """Sum of logarithms of what is left, time, clearest joint, the share left there, and its size."""
        inner = EDGE * (end - start)
        times = np.linspace(start + inner, end - inner, TRIED)
        step = times[1] - times[0]
        for _ in range(REFINED + 1):
            sums = [sum(np.log(left) for left in self._left(Since(recording, t)).values()) for t in times.tolist()]
            time, total = float(times[int(np.argmin(sums))]), float(min(sums))
            times = np.clip(np.linspace(time - step, time + step, BETWEEN), start + inner, end - inner)
            step = 2.0 * step / BETWEEN
        shares = self._left(Since(recording, time))
        told = [j for j in self._joints if shares[j] * self._plain[j] < THAN_ALWAYS * self._always[j]]
        joint = min(told, key=lambda j: shares[j], default=self._joints[0])
        left = shares[joint] if told else 1.0
        size = float(np.sqrt(max(1.0 - left, 0.0) * self._plain[joint] / self._driving[joint]))
        return total, time, joint, left, size

    def _left(self, since: Since) -> dict[int, float]:
        """Share of the mean square that the plain regression leaves, of each joint."""
        found = {}
        for joint in self._joints:
            rows = self._rows.of(joint, WIDTH, self._load, since)
            assert rows is not None
            left = fit(self._rows.robot, joint, rows, self._load).left
            found[joint] = max(left / max(self._plain[joint], 1e-300), 1e-12)
        return found
