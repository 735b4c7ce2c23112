# SPDX-License-Identifier: BSD-3-Clause
"""Which way the joints' encoders count: the signs with which the gyroscopes agree, fewest turned joints first.

Few joints: all patterns. Many: joint after joint, the one whose turn explains most, then pairs. Gyroscopes that stand
still say nothing, and without any there is nothing to try.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.tools.init.estimates.gyro_mount import ALIKE, SeenRate, find_mount, least_left, likely_seats

Array = NDArray[np.float64]
Signs = tuple[float, ...]

HALF, WORTH_TURNING = 0.5, 0.1  # turned joints must leave less than this part, and that much less of the power
ALL_PATTERNS, PAIRS = 4, 12  # joints up to which all patterns, and pairs of joints, are tried
FEW_JOINTS, SEATS = 8, 3  # joints up to which all links are asked, and how many links are with more
MOVING = 0.02  # [rad/s] rms of a joint that a gyroscope could see


@dataclass(frozen=True)
class SignGuess:
    """Which way the encoders count.

    Attributes:
        signs: of the joints, 1 where nothing speaks against it, shape (n,).
        others: other signs with which the gyroscopes agree as well, with as few turned joints.
        mirrored: whether a gyroscope that no rotation explains shall be taken for left-handed.
        by_torques: whether torques say so, not gyroscopes.
    """

    signs: Signs
    others: tuple[Signs, ...] = ()
    mirrored: bool = True
    by_torques: bool = False


def encoder_signs(tree: RigidTree, gyros: Sequence[SeenRate], drives: Callable[[Signs], Sequence[float]]) -> SignGuess:
    """Signs of the joints by gyroscopes and drives.

    Among the patterns with which the gyroscopes agree, the one under which all joints move with their commands is
    right: the equations of motion hold for the mirrored robots, too, but some of their motors turn backwards. A
    gyroscope whose frame is left-handed looks as if an odd number of joints counted backwards, while all move with
    their commands.

    Args:
        tree: the robot.
        gyros: what they and the encoders saw.
        drives: finds -1 for each joint that moves against its command, else 1, if the encoders count with some signs.
    """
    found = joint_signs(tree, gyros)
    if all(sign > 0 for sign in found.signs):
        return found
    forward = [signs for signs in (found.signs, *found.others) if min(drives(signs)) > 0]
    if len(forward) == 1:
        return SignGuess(forward[0], (), mirrored=False)
    mounts = [find_mount(tree, gyro, mirrored=True) for gyro in gyros]
    left = float(np.mean([1.0 if mount is None else mount.left for mount in mounts]))
    straight = (1.0,) * tree.n
    if not forward and min(drives(straight)) > 0 and left < joint_left(tree, gyros, found.signs) + ALIKE:
        return SignGuess(straight, (found.signs, *found.others), mirrored=True)
    return replace(found, mirrored=False)


def joint_left(tree: RigidTree, gyros: Sequence[SeenRate], signs: Signs) -> float:
    """Mean share of the gyroscopes' power that remains with some signs."""
    return _Left(tree, gyros).of(signs)


def joint_signs(tree: RigidTree, gyros: Sequence[SeenRate]) -> SignGuess:
    """Signs of the joints that let the gyroscopes agree with the encoders."""
    straight: Signs = (1.0,) * tree.n
    if not gyros:
        return SignGuess(straight)
    left = _Left(tree, gyros)
    as_is = left.of(straight)
    if as_is < WORTH_TURNING:
        return SignGuess(straight)
    seen = left.joints
    best = _all_patterns(left, seen, straight) if len(seen) <= ALL_PATTERNS else _one_by_one(left, seen, straight)
    least = left.of(best[0])
    if least > HALF * as_is or as_is - least < WORTH_TURNING:
        return SignGuess(straight)
    return SignGuess(best[0], tuple(signs for signs in best[1:] if sum(signs) == sum(best[0])))


class _Left:
    """Mean share of the gyroscopes' power that remains, by pattern."""

    def __init__(self, tree: RigidTree, gyros: Sequence[SeenRate]):
        self._tree, self._gyros = tree, gyros
        self._seats = [likely_seats(tree, gyro, tree.n if tree.n <= FEW_JOINTS else SEATS) for gyro in gyros]
        self._chains = [self._chain(gyro, seats) for gyro, seats in zip(gyros, self._seats, strict=True)]
        self._known: dict[tuple[int, Signs], float] = {}

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints before one of the gyroscopes that turn fast enough to be seen."""
        return tuple(sorted({j for chain in self._chains for j in chain}))

    def of(self, signs: Signs) -> float:
        return float(np.mean([self._of_one(k, signs) for k in range(len(self._gyros))]))

    def _of_one(self, k: int, signs: Signs) -> float:
        chain, gyro = self._chains[k], self._gyros[k]
        key = (k, tuple(signs[j] for j in chain))
        if key not in self._known:
            turned = replace(gyro, q=gyro.q * np.array(signs), v=gyro.v * np.array(signs))
            self._known[key] = least_left(self._tree, turned, self._seats[k])
        return self._known[key]

    def _chain(self, gyro: SeenRate, seats: Sequence[str]) -> tuple[int, ...]:
        speed = np.sqrt(np.mean(gyro.v**2, axis=0))
        below = {j for body in seats for j in self._tree.joints_below(body)}
        return tuple(j for j in sorted(below) if speed[j] > MOVING and self._tree.joints[j] not in self._tree.slides)


def _all_patterns(left: _Left, joints: Sequence[int], straight: Signs) -> list[Signs]:
    """The best patterns, fewest turned joints first."""
    chosen = (np.flatnonzero(turned) for turned in product((False, True), repeat=len(joints)))
    patterns = sorted((_turned(straight, [joints[int(i)] for i in which]) for which in chosen), key=lambda s: -sum(s))
    least = min(left.of(signs) for signs in patterns)
    return [signs for signs in patterns if left.of(signs) < least + ALIKE]


def _one_by_one(left: _Left, joints: Sequence[int], straight: Signs) -> list[Signs]:
    """A pattern that no further turn betters, and its equals on the last step."""
    found = [straight]
    while True:
        now = left.of(found[0])
        if now < ALIKE:
            return found
        steps = [_turned(found[0], (j,)) for j in joints]
        least = min((left.of(signs) for signs in steps), default=now)
        if least > now - ALIKE and len(joints) <= PAIRS:
            steps = [_turned(found[0], pair) for pair in combinations(joints, 2)]
            least = min((left.of(signs) for signs in steps), default=now)
        if least > now - ALIKE:
            return found
        steps.sort(key=lambda signs: -sum(signs))
        found = [signs for signs in steps if left.of(signs) < least + ALIKE]


def _turned(signs: Signs, joints: Sequence[int]) -> Signs:
    return tuple(-sign if j in joints else sign for j, sign in enumerate(signs))
