# SPDX-License-Identifier: BSD-3-Clause
"""The values that all samples share: dynamic parameters, gyro biases and mounting rotations, as one manifold.

A block is one variable of the factor graph: "dynamics" (a vector; positive parameters as logarithms),
"imu1.bias" (a vector) and "imu1.rotation" (a Rot3, changed from the right: R exp(delta)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
DYNAMICS = "dynamics"


def bias_block(sensor: str) -> str:
    """Name of the block with the bias of a gyro or accelerometer."""
    return f"{sensor}.bias"


def rotation_block(gyro: str) -> str:
    """Name of the block with a gyro's mounting rotation R_imu_body."""
    return f"{gyro}.rotation"


@dataclass(frozen=True)
class Calibration:
    """One point on the manifold of shared values.

    Attributes:
        names: names of the free dynamic parameters, shape (p,).
        positive: which of them are estimated as logarithms, shape (p,).
        dynamics: their coordinates: log(value) for positive ones, else the value, shape (p,).
        biases: bias of each gyro and accelerometer, shape (3,) [rad/s], [m/s^2].
        rotations: R_imu_body of each gyro, shape (3, 3).
    """

    names: tuple[str, ...]
    positive: NDArray[np.bool_]
    dynamics: Array
    biases: dict[str, Array]
    rotations: dict[str, Array]

    @staticmethod
    def of(robot: Robot) -> Calibration:
        """The values that a robot has now."""
        free = [parameter for parameter in robot.parameters.values() if not parameter.fixed]
        positive = np.array([p.positive for p in free], dtype=bool)
        values = np.array([p.value for p in free], dtype=float)
        return Calibration(
            names=tuple(p.name for p in free),
            positive=positive,
            dynamics=np.where(positive, np.log(np.where(positive, values, 1.0)), values),
            biases={sensor.name: sensor.bias.copy() for sensor in robot.biased},
            rotations={gyro.name: gyro.R_imu_body.copy() for gyro in robot.gyros},
        )

    def carried_to(self, other: Calibration) -> Calibration:
        """The values of another robot's calibration, with those that this one knows, too."""
        known = dict(zip(self.names, self.dynamics.tolist(), strict=True))
        pairs = zip(other.names, other.dynamics.tolist(), strict=True)
        return Calibration(
            other.names,
            other.positive,
            np.array([known.get(name, value) for name, value in pairs], dtype=float),
            {name: self.biases.get(name, bias) for name, bias in other.biases.items()},
            {name: self.rotations.get(name, R) for name, R in other.rotations.items()},
        )

    @property
    def values(self) -> Array:
        """Values of the free dynamic parameters in their units, shape (p,)."""
        return np.where(self.positive, np.exp(np.where(self.positive, self.dynamics, 0.0)), self.dynamics)

    @property
    def value_by_coordinate(self) -> Array:
        """D value / d coordinate of each dynamic parameter, shape (p,)."""
        return np.where(self.positive, self.values, 1.0)

    @property
    def blocks(self) -> tuple[str, ...]:
        """Names of all blocks in their order: dynamics, rotations, biases (which belong to one bag) last."""
        rotations = tuple(rotation_block(name) for name in self.rotations)
        return (DYNAMICS, *rotations, *(bias_block(name) for name in self.biases))

    def block_size(self, block: str) -> int:
        """Number of coordinates of a block."""
        return len(self.names) if block == DYNAMICS else 3

    def retract(self, step: dict[str, Array]) -> Calibration:
        """Moves along a tangent vector given block by block; missing blocks stay."""
        nothing = np.zeros(3)
        return Calibration(
            self.names,
            self.positive,
            self.dynamics + step.get(DYNAMICS, 0.0),
            {name: bias + step.get(bias_block(name), nothing) for name, bias in self.biases.items()},
            {
                name: R @ Rotation.from_rotvec(step.get(rotation_block(name), nothing)).as_matrix()
                for name, R in self.rotations.items()
            },
        )
