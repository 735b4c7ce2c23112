# SPDX-License-Identifier: BSD-3-Clause
"""The controller of a drive that is commanded by a position: u = clip(gain (goal - reading), +-limit)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RobotError
from jointscope.robots.parts.sensors import Topic
from jointscope.robots.units import si_unit
from jointscope.robots.yaml_section import Section

Array = NDArray[np.float64]

MEASURED = "measured"  # instead of a gain: each recording tells its own


@dataclass(frozen=True)
class PositionController:
    """A proportional controller inside each drive.

    Attributes:
        source: where the goals are in a bag [rad]; a goal that is NaN switches the drive off.
        gain: command per angle of each joint, shape (n,) [unit of the command / rad]; None where each recording tells
            its own, see controller_gain.py.
        limit: largest command [unit of the command].
    """

    source: Topic
    gain: tuple[float, ...] | None
    limit: float

    def command(self, goal: Array, reading: Array) -> Array:
        """Command of every joint, zero where its drive is off; goal and reading of shape (n,) [rad]."""
        assert self.gain is not None
        wanted = np.clip(np.array(self.gain) * (goal - reading), -self.limit, self.limit)
        return np.where(np.isfinite(goal), wanted, 0.0)


def position_controller(section: Section, source: Topic, joints: tuple[str, ...]) -> PositionController:
    """From a section of a robot file, with its topic.

    Raises:
        RobotError: not an angle, another number of gains than of joints, or gains and a limit that are not positive.
    """
    for unit in source.bag_units(len(joints)):
        if si_unit(unit) not in ("rad", "m"):
            raise RobotError(f"{section.place}.unit: a goal position is an angle or a length, got {unit!r}")
    limit = section.number("limit", 1.0, positive=True)
    if section.raw("gain") == MEASURED:
        return PositionController(source, None, limit)
    gain = section.array("gain", (len(joints),))
    if np.any(gain <= 0.0):
        raise RobotError(f"{section.place}.gain: expected numbers above zero, got {gain.tolist()}")
    return PositionController(source, tuple(gain.tolist()), limit)
