# SPDX-License-Identifier: BSD-3-Clause
"""What is measured of an arm at rest: a target on it, by a tracker, or by a ball that sits in the same socket."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Topic

Array = NDArray[np.float64]


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
