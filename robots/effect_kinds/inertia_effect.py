# SPDX-License-Identifier: BSD-3-Clause
"""Effects that change the inertia of a body, linear in their parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import Effect

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class InertiaEffect(Effect):
    """A change of the body that the owner joint moves.

    Attributes:
        change: maps the ten dynamic parameters that the body has, shape (10,), to their change per unit of each effect
            parameter, by name, shape (10,): mass, first moments (x, y, z), Ixx, Ixy, Iyy, Ixz, Iyz, Izz (about the
            origin of the joint frame, pinocchio's order).
        last_only: whether only the last joint can be the owner.
    """

    change: Callable[[Array], dict[str, Array]] = field(repr=False)
    last_only: bool = False

    def joint_of(self, robot: RobotView, owner: str) -> str:
        """The joint whose body changes."""
        return owner

    def change_at(self, robot: RobotView, owner: str, body: Array) -> dict[str, Array]:
        """As `change`, of the instance at one owner."""
        return self.change(body)

    def owners_of(self, robot: RobotView) -> tuple[str, ...]:
        """Joints whose links have an equation of their own, beside those of rotors; all of them, or the last joint."""
        owners = (joint for joint in super().owners_of(robot) if joint not in robot.tree.massless)
        return tuple(joint for joint in owners if not self.last_only or joint == robot.joints[-1])


def about_origin(parameters: Array) -> Array:
    """The inertia among the ten dynamic parameters of a body, about its joint's origin, shape (3, 3) [kg m2]."""
    xx, xy, yy, xz, yz, zz = parameters[4:]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
