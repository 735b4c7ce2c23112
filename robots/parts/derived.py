# SPDX-License-Identifier: BSD-3-Clause
"""Results in the words and units of a robot's builders, which follow from its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Derived:
    """A sum of parameters, or of torques of gravity in a posture, with factors.

    Attributes:
        name: full name, which no parameter has.
        unit: SI unit as text.
        of: factors on parameters by full name.
        gravity: factors on the torques of gravity about joints.
        at: posture, for each joint of the robot [rad, of joints that slide m].
    """

    name: str
    unit: str
    of: Mapping[str, float] = field(default_factory=dict)
    gravity: Mapping[str, float] = field(default_factory=dict)
    at: tuple[float, ...] = ()
