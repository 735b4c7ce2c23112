# SPDX-License-Identifier: BSD-3-Clause
"""Viscous friction in motor and gear beyond the back-EMF: the engine's own joint damping on the rotor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.specification import add_linear, rotor_joint


class MotorViscous(SimulatedEffect):
    """Torque -coefficient v_motor on the rotor."""

    id = "motor_viscous"
    acts_on = ("joint",)
    built_in = True
    defaults: ClassVar[Mapping[str, float]] = {"coefficient": 2.0}  # [N m s/rad]
    never_negative = ("coefficient",)

    def edit(self, spec: Any) -> None:
        """Raises the damping of the rotor."""
        add_linear(spec.joint(rotor_joint(self.robot, self.owner)), "damping", self.parameters["coefficient"])
