# SPDX-License-Identifier: BSD-3-Clause
"""Hysteresis of the spring: small springs beside it that end in sliders with dry friction (Iwan, Maxwell slip).

Each slider is a light hinge in the world with the engine's friction loss, each of its springs a tendon of length
q_link - q_motor - slider. Strengths are spread so that, once all have slid, the torque approaches its other end
exponentially in the deflection with the length that Dahl's law has; small loops inside differ from Dahl's.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.specification import (
    add_dry_friction,
    add_light_body,
    add_tendon,
    set_linear,
)

Array = NDArray[np.float64]

ELEMENTS = 10
SLIDER_RATE = 500.0  # [rad/s] of a slider on its spring: far above the robot; faster ones are lighter and creep more
SLIDER_DAMPING_RATIO = 0.03


class Hysteresis(SimulatedEffect):
    """Up to `torque` beside the spring, turned round within about `deflection`."""

    id = "hysteresis"
    acts_on = ("elastic joint",)
    built_in = True
    defaults: ClassVar[Mapping[str, float]] = {"torque": 3.0, "deflection": 0.01}  # [N m], [rad]
    never_negative = ("torque",)
    above_zero = ("deflection",)

    def edit(self, spec: Any) -> None:
        """Adds sliders and their springs."""
        if self.parameters["torque"] == 0:
            return
        strengths, slips = spread(self.parameters["torque"], self.parameters["deflection"])
        for i, (strength, slip) in enumerate(zip(strengths, slips, strict=True), start=1):
            self._add_element(spec, f"{self.owner}.slider_{i}", strength, stiffness=strength / slip)

    def _add_element(self, spec: Any, name: str, strength: float, stiffness: float) -> None:
        inertia = stiffness / SLIDER_RATE**2
        slider = add_light_body(spec, name, inertia)
        hinge = slider.add_joint(name=name, type=load_mujoco().mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0])
        add_dry_friction(hinge, strength)
        tendon = add_tendon(spec, name, self.owner, self.shares[self.owner])
        tendon.wrap_joint(name, -1.0)
        set_linear(tendon, "stiffness", stiffness)
        set_linear(tendon, "damping", 2.0 * SLIDER_DAMPING_RATIO * stiffness / SLIDER_RATE)


def spread(torque: float, deflection: float) -> tuple[Array, Array]:
    """Elements whose common torque rises as torque (1 - exp(-2 x/deflection)) from rest, piecewise linear.

    On the way back from the one end to the other, every element slides after twice its slip, which makes it
    torque (2 exp(-x/deflection) - 1): the length of Dahl's law.

    Args:
        torque: sum of the strengths [N m].
        deflection: length of Dahl's law [rad].

    Returns:
        Strength [N m] and slip [rad] of each element, each of shape (ELEMENTS,). The curve is met at all slips but the
        last, which replaces the tail by a line of the same area.
    """
    shares = np.arange(1, ELEMENTS + 1) / ELEMENTS
    slips = -0.5 * deflection * np.log(1.0 - shares[:-1])
    slips = np.append(slips, slips[-1] + deflection)
    slopes = np.diff(torque * shares, prepend=0.0) / np.diff(slips, prepend=0.0)
    return -np.diff(slopes, append=0.0) * slips, slips
