# SPDX-License-Identifier: BSD-3-Clause
"""Where everything is in a state vector: x = (q_link, v_link, q_motor, v_motor, memory).

Link coordinates are those of the rigid tree: the joints, and before a joint with a soft bearing its two hinges. A
joint that is declared rigid has no motor coordinates: its motor turns with the link. Memory holds the states that
effects bring along. Positions change with velocities, velocities and memory change with `rates` of the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Columns = NDArray[np.intp]


@dataclass(frozen=True)
class StateLayout:
    """Names and places of all coordinates.

    Attributes:
        joints: names of the n joints.
        links: names of the link coordinates in the order of the tree.
        motors: names of the joints with motor coordinates of their own.
        memories: names of further states.
    """

    joints: tuple[str, ...]
    links: tuple[str, ...]
    motors: tuple[str, ...]
    memories: tuple[str, ...] = ()

    @staticmethod
    def elastic(joints: Sequence[str]) -> StateLayout:
        """The plain robot with elastic joints."""
        names = tuple(joints)
        return StateLayout(names, names, names)

    @cached_property
    def n_link(self) -> int:
        """Number of link coordinates."""
        return len(self.links)

    @cached_property
    def n_motor(self) -> int:
        """Number of motor coordinates."""
        return len(self.motors)

    @cached_property
    def size(self) -> int:
        """Length d of a state."""
        return 2 * (self.n_link + self.n_motor) + len(self.memories)

    @cached_property
    def n_rates(self) -> int:
        """Number of velocities and memories."""
        return self.n_link + self.n_motor + len(self.memories)

    @cached_property
    def q_link(self) -> slice:
        """Link positions."""
        return slice(0, self.n_link)

    @cached_property
    def v_link(self) -> slice:
        """Link velocities."""
        return slice(self.n_link, 2 * self.n_link)

    @cached_property
    def q_motor(self) -> slice:
        """Motor positions."""
        return slice(2 * self.n_link, 2 * self.n_link + self.n_motor)

    @cached_property
    def v_motor(self) -> slice:
        """Motor velocities."""
        return slice(2 * self.n_link + self.n_motor, 2 * (self.n_link + self.n_motor))

    @cached_property
    def memory(self) -> slice:
        """Memories."""
        return slice(2 * (self.n_link + self.n_motor), self.size)

    @cached_property
    def positions(self) -> Columns:
        """Columns of all positions, link before motor."""
        return np.r_[self.q_link, self.q_motor].astype(np.intp)

    @cached_property
    def velocities(self) -> Columns:
        """Columns of their velocities."""
        return np.r_[self.v_link, self.v_motor].astype(np.intp)

    @cached_property
    def rates(self) -> Columns:
        """Columns that change with the rates of the model: velocities, then memories."""
        return np.r_[self.v_link, self.v_motor, self.memory].astype(np.intp)

    @cached_property
    def joint_link(self) -> Columns:
        """Link coordinate of each joint, shape (n,)."""
        return np.array([self.links.index(joint) for joint in self.joints], dtype=np.intp)

    @cached_property
    def joint_q(self) -> Columns:
        """Column of each joint's link position, shape (n,)."""
        return self.joint_link

    def velocities_at(self, side: str) -> Columns:
        """Columns of each joint's velocity at the "link" or the "motor", as friction depends on one of them."""
        return self.joint_v if side == "link" else self.motor_v

    @cached_property
    def joint_v(self) -> Columns:
        """Column of each joint's link velocity, shape (n,)."""
        return self.n_link + self.joint_link

    @cached_property
    def motor_q(self) -> Columns:
        """Column of each joint's motor position, shape (n,); that of the link where the joint is rigid."""
        start = 2 * self.n_link
        own = [start + self.motors.index(j) if j in self.motors else self.links.index(j) for j in self.joints]
        return np.array(own, dtype=np.intp)

    @cached_property
    def motor_v(self) -> Columns:
        """Column of each joint's motor velocity, shape (n,); that of the link where the joint is rigid."""
        start = 2 * self.n_link + self.n_motor
        own = [
            start + self.motors.index(j) if j in self.motors else self.n_link + self.links.index(j) for j in self.joints
        ]
        return np.array(own, dtype=np.intp)

    @cached_property
    def motor_row(self) -> Columns:
        """Equation in which each motor's torque stands, shape (n,); that of the link where the joint is rigid."""
        own = [self.n_link + self.motors.index(j) if j in self.motors else self.links.index(j) for j in self.joints]
        return np.array(own, dtype=np.intp)

    @cached_property
    def elastic_joints(self) -> tuple[int, ...]:
        """Indices of the joints with motor coordinates of their own."""
        return tuple(i for i, joint in enumerate(self.joints) if joint in self.motors)

    @property
    def rate_names(self) -> tuple[str, ...]:
        """Names of the equations: "joint1.link", ..., "joint1.motor", ..., memories."""
        link, motor = (f"{name}.link" for name in self.links), (f"{name}.motor" for name in self.motors)
        return (*link, *motor, *self.memories)

    def by_joint(self, x: Array) -> Array:
        """States as (q_link, v_link, q_motor, v_motor) of the joints alone, shape (..., 4n)."""
        return x[..., np.concatenate([self.joint_q, self.joint_v, self.motor_q, self.motor_v])]

    def from_joints(self, x: Array) -> Array:
        """States from (q_link, v_link, q_motor, v_motor) of the joints, everything else zero, shape (m, d)."""
        full = np.zeros((len(x), self.size))
        for columns, part in zip(
            (self.motor_q, self.motor_v, self.joint_q, self.joint_v),
            np.split(x, 4, axis=1)[2:] + np.split(x, 4, axis=1)[:2],
            strict=True,
        ):
            full[:, columns] = part
        return full

    def carried_over(self, x: Array, other: StateLayout) -> Array:
        """States of another layout in this one; coordinates that it does not have are zero, shape (m, d)."""
        full = np.zeros((len(x), self.size))
        places = self._places()
        for name, column in other._places().items():
            if name in places:
                full[:, places[name]] = x[:, column]
        for i, joint in enumerate(self.joints):
            if joint in self.motors and joint not in other.motors:
                full[:, self.motor_q[i]], full[:, self.motor_v[i]] = x[:, other.motor_q[i]], x[:, other.motor_v[i]]
        return full

    def _places(self) -> dict[str, int]:
        names = [f"{kind}.{name}" for kind in ("q", "v") for name in self.links]
        names += [f"{kind}.{name}.motor" for kind in ("q", "v") for name in self.motors]
        return {name: column for column, name in enumerate([*names, *self.memories])}
