# SPDX-License-Identifier: BSD-3-Clause
"""What is measured of an arm at rest: a target on it, by a tracker, or by a ball that sits in the same socket."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Topic

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MountedTarget:
    """A target on the tool.

    Attributes:
        name: in tables, and the owner of its errors in the robot file.
        link: link of the URDF that carries it.
        at: its place in the axes of that link, shape (3,) [m]; None where it is found from the poses.
        turn: its orientation there, R_link_target, shape (3, 3); None where it is found from the poses.
        positions: where its positions are in a bag.
    """

    name: str
    link: str
    at: Array | None
    turn: Array | None
    positions: Topic


@dataclass(frozen=True)
class PoseSetup:
    """The section `poses` of a robot file.

    Attributes:
        link: link of the URDF that carries the target.
        at: the target in its axes, shape (3,) [m].
        tracker_link: link of the URDF in whose axes the tracker measures; None where its place is not known.
        tracker: where it stands, as a matrix, shape (4, 4), base from tracker; None for that of its link, or unknown.
        joint_states: where the joints' positions are in a bag.
        positions: where the target's positions are in a bag.
        target_sigma: noise of the mean of a pose [m].
        joint_sigmas: repeatability of each joint, which its encoder does not see, shape (n,) [rad].
        estimate_sigma: whether the residuals tell the size of the repeatability.
        length_sigma, angle_sigma: how large geometric errors may be, 1 sigma [m], [rad].
        tool_sigma: how well the place of the target is known [m].
        turn: orientation of the target in the axes of its link, R_link_target, shape (3, 3); None where it is found
            from the poses.
        turn_sigma: noise of the orientation of a target [rad].
        estimate_turn_sigma: whether the residuals tell it.
        others: further targets on the tool.
        contact_distance: between the two contacts of one place [m]; None where it is not known.
    """

    link: str
    at: Array
    tracker_link: str | None
    tracker: Array | None
    joint_states: Topic
    positions: Topic
    target_sigma: float
    joint_sigmas: Array
    estimate_sigma: bool
    length_sigma: float
    angle_sigma: float
    tool_sigma: float
    contact_distance: float | None = None
    turn: Array | None = None
    turn_sigma: float = 1e-4
    estimate_turn_sigma: bool = False
    others: tuple[MountedTarget, ...] = ()

    @property
    def targets(self) -> tuple[MountedTarget, ...]:
        """All targets on the tool; the first one has the name of its link."""
        return (MountedTarget(self.link, self.link, self.at, self.turn, self.positions), *self.others)

    @property
    def other_names(self) -> tuple[str, ...]:
        """Names of the further targets."""
        return tuple(target.name for target in self.others)
