# SPDX-License-Identifier: BSD-3-Clause
"""A named block of shared values: one variable of the factor graph, whatever kind of recording sees it.

Its kind says which manifold it lives on, its scope who shares it. Who needs a value of a new sort declares a block;
layouts, elimination, GTSAM's keys and covariances follow from that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import gtsam
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
Scope = Literal["robot", "recording", "session", "contact"]

PER_OWNER = 1000  # blocks of one letter that a recording may have for itself


@dataclass(frozen=True)
class BlockKind:
    """A manifold.

    Attributes:
        name: "vector", "point", "Rot3" or "Pose3".
        retract: value after a tangent step.
        local: tangent step from a value to another.
        to_gtsam: the value as GTSAM holds it.
        from_gtsam: reads the value of a key.
    """

    name: str
    retract: Callable[[Array, Array], Array]
    local: Callable[[Array, Array], Array]
    to_gtsam: Callable[[Array], Any]
    from_gtsam: Callable[[gtsam.Values, int], Array]

    def __reduce__(self) -> tuple[Callable[[str], BlockKind], tuple[str]]:
        """Another process has the same kinds."""
        return _kind, (self.name,)


def _kind(name: str) -> BlockKind:
    return next(kind for kind in (VECTOR, POINT, ROT3, POSE3) if kind.name == name)


def _turned(R: Array, step: Array) -> Array:
    return np.asarray(R @ Rotation.from_rotvec(step).as_matrix())


def _turn(before: Array, now: Array) -> Array:
    return np.asarray(Rotation.from_matrix(before.T @ now).as_rotvec())


def _plus(value: Array, step: Array) -> Array:
    return value + step


def _minus(before: Array, now: Array) -> Array:
    return now - before


def _vector_of(values: gtsam.Values, key: int) -> Array:
    return np.asarray(values.atVector(key))


VECTOR = BlockKind("vector", _plus, _minus, lambda value: value, _vector_of)
POINT = BlockKind("point", _plus, _minus, lambda value: value, _vector_of)
ROT3 = BlockKind("Rot3", _turned, _turn, gtsam.Rot3, lambda values, key: np.asarray(values.atRot3(key).matrix()))
POSE3 = BlockKind(
    "Pose3",
    lambda T, step: np.asarray(gtsam.Pose3(T).retract(step).matrix()),
    lambda before, now: np.asarray(gtsam.Pose3(before).localCoordinates(gtsam.Pose3(now))),
    gtsam.Pose3,
    lambda values, key: np.asarray(values.atPose3(key).matrix()),
)
"""A 4 x 4 matrix; tangent steps are (rotation, translation), changed from the right."""


@dataclass(frozen=True)
class Block:
    """What is known of a block beside its value.

    Attributes:
        name: "dynamics", "imu1.bias", ...; blocks of one name are one value, or one for each recording by their scope.
        kind: its manifold.
        scope: "robot"; "recording": each has its own; "session" and "contact": shared by all that name it, but nothing
            of the robot's: another session has a block of another name.
        size: number of tangent coordinates.
        letter, number: of its key in GTSAM's graph.
    """

    name: str
    kind: BlockKind
    scope: Scope
    size: int
    letter: str
    number: int = 0

    @property
    def own(self) -> bool:
        """Whether each recording has its own."""
        return self.scope == "recording"

    def key(self, owner: int = 0) -> int:
        """Key of the block in GTSAM's graph; `owner` is the number of the recording."""
        return int(gtsam.symbol(self.letter, self.number + (owner * PER_OWNER if self.own else 0)))
