# SPDX-License-Identifier: BSD-3-Clause
r"""Dry friction that grows with the torque that a drive passes on, beyond the weight that it holds.

    k u = M a + c + g + b a + d v + (mu + share |k u - g|) sign(v)

No effect of rigid joints knows it: their `load_dependent_friction` grows with the weight alone. A few percent of it are
lost in the noise of what else a joint lacks, but make inertias wrong by as much: where a drive accelerates, friction
rises with the acceleration. So its factor is asked for with a sigma, from blocks of the recording left out in turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.regression.joint_regression import (
    DELAY,
    Fit,
    JointRows,
    changes_between,
    fit,
    of_drives,
    sigma_of,
)
from jointscope.graphs.starts.drive_starts import LIMIT, PLAIN
from jointscope.graphs.starts.windowed_sums import SIGNALS, WIDTHS

Array = NDArray[np.float64]

ROUNDS = 3  # in which the constant is found with the friction
SURE = 4.5  # [sigma], over some 20 blocks: one joint in ten thousand by chance
SMALL = 0.02  # share of the torque, below which it matters to nobody
LARGE = 0.3  # share beyond which it is something else: gears lose a fifth
MOVED = 0.01  # share by which it must change a value
FEWEST_BLOCKS = 8


@dataclass(frozen=True)
class LoadFriction:
    """Friction of one joint that grows with its torque.

    Attributes:
        joint: whose drive.
        share: of the torque.
        sigma: its standard deviation.
        with_it: parameters of the joint with it over those without, by name.
    """

    joint: str
    share: float
    sigma: float
    with_it: dict[str, float]


def load_frictions(rows: JointRows) -> tuple[LoadFriction, ...]:
    """The joints whose friction surely grows with their torque, by so much that it matters.

    Args:
        rows: of the regression.
    """
    robot = rows.robot
    # what else a robot has is regressed on to first order only, which a few percent of a torque do not bear
    if any(here.effect.id not in (PLAIN, LIMIT) and here.label != DELAY for here in of_drives(robot)):
        return ()
    found = []
    for joint in range(robot.n):
        told = [one for width in WIDTHS if (one := _under(rows, joint, width)) is not None]
        best = min(told, key=lambda one: one.sigma, default=None)
        if best is not None and _matters(best):
            found.append(best)
    return tuple(found)


def _matters(one: LoadFriction) -> bool:
    moved = max((abs(factor - 1.0) for factor in one.with_it.values()), default=0.0)
    possible = one.share < LARGE and min(one.with_it.values(), default=1.0) > 0.0
    return possible and one.share > max(SURE * one.sigma, SMALL) and moved > MOVED


def _under(rows: JointRows, joint: int, width: float) -> LoadFriction | None:
    """What windows of one width [s] say; None where they say nothing."""
    motions, robot = rows.motions(joint), rows.robot
    without = rows.beside(joint, width, [[] for _ in motions])
    if without is None:
        return None
    plain = found = fit(robot, joint, without[0])
    for _ in range(ROUNDS):
        columns = [[_growing(found.gain, signals, weight)] for signals, weight in motions]
        beside = rows.beside(joint, width, columns)
        assert beside is not None
        here, blocks = beside
        found = fit(robot, joint, here)
    sigma = sigma_of(_share, robot, joint, here, blocks, FEWEST_BLOCKS) if found.gain > 0.0 else None
    if sigma is None:
        return None
    name = robot.joints[joint]
    return LoadFriction(name, _share(found), sigma, changes_between(robot, name, plain, found))


def _share(found: Fit) -> float:
    return float(found.more[-1] * found.gain)


def _growing(gain: float, signals: Array, weight: Array) -> Array:
    """What a unit of the share adds, shape (m,) [N m]."""
    driving = gain * signals[:, SIGNALS.index("command")]
    return np.asarray(np.abs(driving - weight) * signals[:, SIGNALS.index("dry")])
