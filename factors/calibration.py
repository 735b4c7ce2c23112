# SPDX-License-Identifier: BSD-3-Clause
"""The values that all samples share, block by block, as one manifold.

A motion has "dynamics" (a vector; positive parameters as logarithms), "imu1.rotation" (a Rot3, changed from the right:
R exp(delta)) and "imu1.bias" (a vector of each recording's own). Other kinds of recordings bring blocks of theirs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.block import ROT3, VECTOR, Block
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
DYNAMICS = "dynamics"
BIAS, ROTATION = ".bias", ".rotation"


def bias_block(sensor: str) -> str:
    """Name of the block with the bias of a gyro or accelerometer."""
    return f"{sensor}{BIAS}"


def rotation_block(gyro: str) -> str:
    """Name of the block with a gyro's mounting rotation R_imu_body."""
    return f"{gyro}{ROTATION}"


@dataclass(frozen=True)
class Calibration:
    """One point on the manifold of shared values.

    Attributes:
        names: names of the free dynamic parameters, shape (p,).
        positive: which of them are estimated as logarithms, shape (p,).
        layout: what is known of each block, by name, in their order: those that each recording has for itself last.
        points: value of each block, by name.
    """

    names: tuple[str, ...]
    positive: NDArray[np.bool_]
    layout: Mapping[str, Block]
    points: Mapping[str, Array]

    @staticmethod
    def of(robot: Robot) -> Calibration:
        """The values that a robot has now."""
        free = [parameter for parameter in robot.parameters.values() if not parameter.fixed]
        positive = np.array([p.positive for p in free], dtype=bool)
        values = np.array([p.value for p in free], dtype=float)
        coordinates = np.where(positive, np.log(np.where(positive, values, 1.0)), values)
        blocks = [(Block(DYNAMICS, VECTOR, "robot", len(free), "d"), coordinates)]
        for i, gyro in enumerate(robot.gyros):
            blocks.append((Block(rotation_block(gyro.name), ROT3, "robot", 3, "r", i), gyro.R_imu_body.copy()))
        for i, sensor in enumerate(robot.biased):
            blocks.append((Block(bias_block(sensor.name), VECTOR, "recording", 3, "b", i), sensor.bias.copy()))
        layout, points = {b.name: b for b, _ in blocks}, {b.name: value for b, value in blocks}
        return Calibration(tuple(p.name for p in free), positive, layout, points)

    def __getitem__(self, block: str) -> Array:
        """Value of a block."""
        return self.points[block]

    @property
    def dynamics(self) -> Array:
        """Coordinates of the free dynamic parameters: log(value) for positive ones, else the value, shape (p,)."""
        return self.points[DYNAMICS]

    @cached_property
    def biases(self) -> dict[str, Array]:
        """Bias of each gyro and accelerometer, shape (3,) [rad/s], [m/s^2]."""
        return {name.removesuffix(BIAS): value for name, value in self.points.items() if name.endswith(BIAS)}

    @cached_property
    def rotations(self) -> dict[str, Array]:
        """R_imu_body of each gyro, shape (3, 3)."""
        return {name.removesuffix(ROTATION): R for name, R in self.points.items() if name.endswith(ROTATION)}

    def carried_to(self, other: Calibration) -> Calibration:
        """The values of another robot's calibration, with those that this one knows, too."""
        known = dict(zip(self.names, self.dynamics.tolist(), strict=True))
        pairs = zip(other.names, other.dynamics.tolist(), strict=True)
        dynamics = np.array([known.get(name, value) for name, value in pairs], dtype=float)
        shared = {name: value for name, value in self.points.items() if name in other.layout}
        return other.with_points({**shared, DYNAMICS: dynamics})

    @property
    def values(self) -> Array:
        """Values of the free dynamic parameters in their units, shape (p,)."""
        return np.where(self.positive, np.exp(np.where(self.positive, self.dynamics, 0.0)), self.dynamics)

    @property
    def by_name(self) -> dict[str, float]:
        """Values of the dynamic parameters by full name."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    @property
    def value_by_coordinate(self) -> Array:
        """D value / d coordinate of each dynamic parameter, shape (p,)."""
        return np.where(self.positive, self.values, 1.0)

    @property
    def blocks(self) -> tuple[str, ...]:
        """Names of all blocks in their order."""
        return tuple(self.layout)

    @property
    def own(self) -> dict[str, Array]:
        """Values of the blocks that each recording has for itself, by name."""
        return {name: self.points[name] for name, block in self.layout.items() if block.own}

    @property
    def common(self) -> dict[str, Array]:
        """Values of the blocks that recordings share, by name."""
        return {name: self.points[name] for name, block in self.layout.items() if not block.own}

    @cached_property
    def columns(self) -> dict[str, slice]:
        """Columns of each block where all stand side by side."""
        stops = np.cumsum([block.size for block in self.layout.values()]).tolist()
        return {b.name: slice(stop - b.size, stop) for b, stop in zip(self.layout.values(), stops, strict=True)}

    @cached_property
    def size(self) -> int:
        """Number of coordinates of all blocks."""
        return sum(block.size for block in self.layout.values())

    def free(self, hold: Sequence[str]) -> tuple[str, ...]:
        """Names of the blocks that may change: those that are not held, and not empty."""
        return tuple(block for block in self.layout if block not in hold and self.block_size(block))

    def block_size(self, block: str) -> int:
        """Number of coordinates of a block."""
        return self.layout[block].size

    def with_points(self, points: Mapping[str, Array]) -> Calibration:
        """The same with other values of some blocks.

        Raises:
            KeyError: a block that is not there.
        """
        unknown = points.keys() - self.layout.keys()
        if unknown:
            raise KeyError(f"no block {', '.join(sorted(unknown))}; there are {', '.join(self.layout)}")
        return replace(self, points={**self.points, **points})

    def with_blocks(self, more: Sequence[tuple[Block, Array]]) -> Calibration:
        """The same with further blocks; those that each recording has for itself stay last."""
        everything = [(block, self.points[name]) for name, block in self.layout.items()] + list(more)
        ordered = sorted(everything, key=lambda pair: pair[0].own)
        layout, points = {b.name: b for b, _ in ordered}, {b.name: value for b, value in ordered}
        return replace(self, layout=layout, points=points)

    def only(self, blocks: Sequence[str]) -> Calibration:
        """The same with these blocks alone, in the order that they have here."""
        layout = {name: block for name, block in self.layout.items() if name in blocks}
        return replace(self, layout=layout, points={name: self.points[name] for name in layout})

    def retract(self, step: Mapping[str, Array]) -> Calibration:
        """Moves along a tangent vector given block by block; missing blocks stay."""
        moved = {name: self.layout[name].kind.retract(self.points[name], d) for name, d in step.items()}
        return self.with_points(moved)

    def local(self, other: Calibration, block: str) -> Array:
        """Tangent step of a block from here to another point."""
        return self.layout[block].kind.local(self.points[block], other.points[block])

    def is_at(self, other: Calibration) -> bool:
        """Whether that is the same point, to the last digit."""
        return all(np.array_equal(value, other.points[name]) for name, value in self.points.items())
