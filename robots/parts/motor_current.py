# SPDX-License-Identifier: BSD-3-Clause
"""Measured currents of the motors, beside the commands that drive them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from jointscope.robots.parts.sensors import Topic


@dataclass(frozen=True)
class MotorCurrent:
    """Currents of all motors, a second witness of their torques; the law is that of `MotorCurrents`.

    A sample with the stamp of a new command belongs to the command before it: a drive reads its current before it
    changes what drives it.

    Attributes:
        name: key in the robot file.
        source: topic.
        sigmas: standard deviation of the noise of each motor, shape (n_joints,) [A].
        joints: names of the joints.
        delay: how much older a reading is than its stamp [s]; below zero where it sees the command of its own stamp.
        delay_sigma: half of the range of delays that fit as well, after a calibration [s]; None before.
        estimate_delay: whether a calibration may find another delay.
    """

    name: str
    source: Topic
    sigmas: NDArray[np.float64]
    joints: tuple[str, ...]
    delay: float = 0.0
    delay_sigma: float | None = None
    estimate_delay: bool = True

    @property
    def channels(self) -> tuple[str, ...]:
        """Channel names, one per joint."""
        return tuple(f"{joint}.motor_current" for joint in self.joints)

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each channel."""
        return ("A",) * len(self.joints)

    def torque_per_ampere(self, joint: str) -> str:
        """Full name of the torque of one ampere at a joint [N m/A], behind the gear."""
        return f"{self.name}.torque_per_ampere_{joint}"

    def back_emf(self, joint: str) -> str:
        """Full name of the current that a speed takes away [A s/rad], where it is not that of the volts' constant."""
        return f"{self.name}.back_emf_{joint}"

    def offset(self, joint: str) -> str:
        """Full name of what the sensor of a joint reads without a current [A]."""
        return f"{self.name}.offset_{joint}"

    @property
    def own(self) -> tuple[str, ...]:
        """All parameters that a robot file may have of it."""
        return tuple(name for joint in self.joints for name in self.of_joint(joint))

    def of_joint(self, joint: str) -> tuple[str, str, str]:
        """Those of one joint."""
        return self.torque_per_ampere(joint), self.back_emf(joint), self.offset(joint)

    def parameter_units(self, joint: str) -> dict[str, str]:
        """Their units, of a joint that turns."""
        return dict(zip(self.of_joint(joint), ("N m/A", "A s/rad", "A"), strict=True))
