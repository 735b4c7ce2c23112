# SPDX-License-Identifier: BSD-3-Clause
"""A target on a link whose position a tracker measures while the robot moves: a camera, motion capture, a laser."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from jointscope.robots.parts.sensors import Topic

Array = NDArray[np.float64]
AXES = "xyz"


@dataclass(frozen=True)
class PositionTarget:
    """p_tracker = R_tracker_base (p_base - place) + noise, of a point that is fixed to a link.

    What the file says of target and tracker may be off by parameters of the robot, those that its file lists:
    NAME.offset_x .. z [m] of the target along the axes of its link, TRACKER.tracker_x .. z [m] of the tracker along
    the axes of the base, and TRACKER.tracker_turn_x .. z [rad], a turn about the tracker's own axes.

    Attributes:
        name: key in the robot file ("marker3").
        source: topic.
        body: URDF link that carries the target.
        at: the target in the axes of that link, shape (3,) [m].
        tracker_link: URDF link, fixed to the base, in whose axes the tracker measures; None where the pose says it.
        tracker_pose: base from tracker, shape (4, 4).
        tracker: name of the target whose tracker this is, and whose parameters say how far off its pose is.
        sigma: standard deviation of the noise of each component [m].
    """

    name: str
    source: Topic
    body: str
    at: Array
    tracker_link: str | None
    tracker_pose: Array
    tracker: str
    sigma: float

    @property
    def channels(self) -> tuple[str, ...]:
        """Channel names, one per axis."""
        return tuple(f"{self.name}.{axis}" for axis in AXES)

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each channel."""
        return ("m",) * 3

    @property
    def sigmas(self) -> Array:
        """Standard deviation of the noise of each channel, shape (3,) [m]."""
        return np.full(3, self.sigma)

    @property
    def offset(self) -> tuple[str, ...]:
        """Names of how far the target is from where the file says."""
        return tuple(f"{self.name}.offset_{axis}" for axis in AXES)

    @property
    def place(self) -> tuple[str, ...]:
        """Names of how far its tracker is."""
        return tuple(f"{self.tracker}.tracker_{axis}" for axis in AXES)

    @property
    def turn(self) -> tuple[str, ...]:
        """Names of how far its tracker is turned."""
        return tuple(f"{self.tracker}.tracker_turn_{axis}" for axis in AXES)

    @property
    def parameters(self) -> dict[str, str]:
        """Units of all parameters that the robot file may have, by full name."""
        return dict.fromkeys((*self.offset, *self.place), "m") | dict.fromkeys(self.turn, "rad")

    @property
    def own(self) -> tuple[str, ...]:
        """All of these names."""
        return tuple(self.parameters)

    def seen(self, values: Mapping[str, float]) -> tuple[Array, Array, Array, Array]:
        """Target and tracker with these values of their parameters, zero where there is none.

        Returns:
            The target in the axes of its link, shape (3,) [m]; R_base_tracker, shape (3, 3); place of the tracker in
            the base, shape (3,) [m]; turn [rad] that is part of the rotation, shape (3,).
        """
        at, place, turn = (
            np.array([values.get(name, 0.0) for name in names]) for names in (self.offset, self.place, self.turn)
        )
        R = self.tracker_pose[:3, :3] @ turned(turn)
        return self.at + at, R, self.tracker_pose[:3, 3] + place, turn


def turned(turn: Array) -> Array:
    """Exp([turn]x), shape (3, 3), of a rotation vector, shape (3,) [rad]."""
    x, y, z = turn
    K, angle = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]), float(np.linalg.norm(turn))
    # sin(a)/a and (1 - cos(a))/a^2 without a division by a small number
    return np.eye(3) + np.sinc(angle / np.pi) * K + 0.5 * np.sinc(0.5 * angle / np.pi) ** 2 * (K @ K)
