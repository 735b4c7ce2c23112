# SPDX-License-Identifier: BSD-3-Clause
"""The drive follows its command late, as a first-order lag: the engine's own actuator dynamics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.robots.errors import EffectError
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.specification import drive

LEAST = 1e-4  # [s] a shorter one cannot be integrated at the engine's step


class MotorLag(SimulatedEffect):
    """The command passes a first-order lag; the back-EMF does not."""

    id = "motor_lag"
    acts_on = ("joint", "robot")
    built_in = True
    defaults: ClassVar[Mapping[str, float]] = {"time_constant": 3e-3}  # [s]
    never_negative = ("time_constant",)

    def edit(self, spec: Any) -> None:
        """Gives the motors a filter state."""
        time_constant = self.parameters["time_constant"]
        if 0 < time_constant < LEAST:
            raise EffectError(
                f"effect {self.id}@{self.owner}: time_constant must be 0 or at least {LEAST:g} s, got {time_constant:g}"
            )
        for joint in self.joints if time_constant > 0 else ():
            motor = spec.actuator(drive(joint))
            motor.dyntype = load_mujoco().mjtDyn.mjDYN_FILTER
            motor.dynprm[0] = time_constant
