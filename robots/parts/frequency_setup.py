# SPDX-License-Identifier: BSD-3-Clause
"""What is shaken and measured of an arm for its frequency response: torques and positions of some motors."""

from __future__ import annotations

from dataclasses import dataclass

from jointscope.robots.parts.sensors import Topic


@dataclass(frozen=True)
class FrequencySetup:
    """The section `frequency` of a robot file.

    Attributes:
        joints: whose motors are shaken; all others are locked where they stand.
        torques: where the torques of the motors are in a bag.
        positions: where the positions of all joints are.
    """

    joints: tuple[str, ...]
    torques: Topic
    positions: Topic
