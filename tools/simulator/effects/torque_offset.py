# SPDX-License-Identifier: BSD-3-Clause
"""A constant torque on the rotor, as from an offset of the current sensor: a constant of the engine's actuator."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.specification import drive


class TorqueOffset(SimulatedEffect):
    """Constant torque on the rotor."""

    id = "torque_offset"
    acts_on = ("joint",)
    built_in = True
    defaults: ClassVar[Mapping[str, float]] = {"torque": 1.0}  # [N m]
    loads_at_rest = True

    def edit(self, spec: Any) -> None:
        """Sets the constant of the drive's affine bias."""
        spec.actuator(drive(self.owner)).biasprm[0] += self.parameters["torque"]
