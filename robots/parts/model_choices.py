# SPDX-License-Identifier: BSD-3-Clause
"""Choices of a model that are not parameters."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ModelChoices:
    """What kind of model it is.

    Attributes:
        integrator: "euler" (eq. 31), "midpoint" or "simpson".
        coriolis: whether c(q, v) is part of the model.
        friction_velocity: "motor", or "link" as eq. (12) is printed.
        friction_sharpness: k in tanh(k v) [s/rad] of joints that have no parameter of that name.
        bias_at_rest: whether gyro samples before the first command measure the bias directly (eq. 32).
        rigid_joints: joints whose link follows the motor without a spring.
        link_dynamics: "model" (equations of motion of the links), or "free": their masses are not known, and only
            what does not need them is modelled, the transmissions and the gyros.
    """

    integrator: str = "simpson"
    coriolis: bool = True
    friction_velocity: str = "motor"
    friction_sharpness: float = 200.0
    bias_at_rest: bool = False
    rigid_joints: tuple[str, ...] = ()
    link_dynamics: str = "model"
