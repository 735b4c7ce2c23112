# SPDX-License-Identifier: BSD-3-Clause
"""Channels of a sensor on all drives that are exchanged, count backwards or have another unit: sentences, and whose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.screening.exchanged_joints import names_or_places
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.sensors import TorqueSensor

Array = NDArray[np.float64]

CLEARLY = 3.0  # times less that another drive must leave
THOUSAND, NEAR = 1000.0, 2.4  # the factor between a unit and one with a prefix, and how far a ratio may be from it


@dataclass(frozen=True)
class DriveChannels:
    """One channel per joint.

    Attributes:
        robot: as its file has it.
        sensor: of torques or currents.
        quantity: what it measures, as "torque".
    """

    robot: Robot
    sensor: TorqueSensor | MotorCurrent
    quantity: str

    def exchanged(self, own: NDArray[np.intp]) -> str:
        """That channels belong to other joints, `own` being the joint of each, shape (n,)."""
        names = names_or_places(self.sensor.source, self.robot.n)
        right = [names[channel] for channel in np.argsort(own)]
        wrong = [joint for k, joint in enumerate(self.robot.joints) if own[k] != k]
        return (
            f"{self.sensor.name}: {self.quantity}s of {' and '.join(wrong)} seem to be exchanged: so the drives "
            f"explain them; if that is so, write `names: [{', '.join(right)}]` in {self._section}"
        )

    def scaled(self, factors: Array, looks: tuple[str, str]) -> str:
        """That channels are to be multiplied, by a sign, a power of a thousand or both.

        Args:
            factors: of each joint, shape (n,).
            looks: of sizes that are to be divided by a thousand, and of those to be multiplied by it.
        """
        joints = zip(self.robot.joints, factors, strict=True)
        wrong = ", ".join(joint for joint, factor in joints if factor != 1.0)
        reasons = ["counts the other way than its drive"] if np.any(factors < 0.0) else []
        sizes = np.abs(factors)
        if np.any(sizes != 1.0):
            reasons.append(looks[0 if sizes[sizes != 1.0][0] < 1.0 else 1])
        scale = ", ".join(f"{factor:.12g}" for factor in factors * np.asarray(self.sensor.source.scale or 1.0))
        return (
            f"{self.sensor.name}: {self.quantity} of {wrong} {' and '.join(reasons)}; if that is so, write "
            f"`scale: [{scale}]` in {self._section}"
        )

    @property
    def _section(self) -> str:
        return f"sensors.{self.sensor.name} of {robot_argument(self.robot)}"


def belongs_to(left: Array, most: float = np.inf) -> NDArray[np.intp]:
    """Joint of each channel: another one than its own where it fits clearly better, all of them together.

    Args:
        left: share of each channel that the drive of each joint leaves, shape (channels, joints).
        most: share that another drive may leave.
    """
    own = np.arange(len(left))
    best = np.argmin(left, axis=1)
    better = left[own, best] < np.minimum(left[own, own] / CLEARLY, most)
    return best if sorted(best) == list(own) and bool(np.all(better[best != own])) else own


def thousands(ratio: float) -> float:
    """The power of a thousand that makes a ratio one, 1 where none does."""
    near = (factor for factor in (THOUSAND, 1.0 / THOUSAND) if 1.0 / NEAR < ratio * factor < NEAR)
    return next(near, 1.0)
