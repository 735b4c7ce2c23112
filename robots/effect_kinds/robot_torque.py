# SPDX-License-Identifier: BSD-3-Clause
"""Effects whose torques depend on, or act on, several joints."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from jointscope.robots.effect_kinds.effect import Effect


@dataclass(frozen=True)
class RobotSignals:
    """Motion of all joints at m samples, in link units; arrays of shape (m, n), complex while derivatives are taken.

    Attributes:
        q_link, q_motor: positions [rad].
        v_link, v_motor: velocities [rad/s].
        stiffness, damping: K [N m/rad] and D [N m s/rad] of every joint, shape (n,).
        joints: names of the joints.
        owner: index of the owner.
        sharpness: k of the base model's friction law of every joint, shape (n,) [s/rad].
    """

    q_link: Any
    v_link: Any
    q_motor: Any
    v_motor: Any
    stiffness: Any
    damping: Any
    joints: tuple[str, ...]
    owner: int
    sharpness: Any


@dataclass(frozen=True, kw_only=True)
class RobotTorque(Effect):
    """Torques on the link and the motor side of all joints; an owner that is a joint must have a spring.

    Attributes:
        law: (tau_link, tau_motor) added to the right-hand sides, shape (m, n) each [N m]; zero at the null values,
            complex-safe.
    """

    law: Callable[[RobotSignals, Mapping[str, Any]], tuple[Any, Any]] = field(repr=False)
