# SPDX-License-Identifier: BSD-3-Clause
"""A drive that makes another torque of its command than the data sheet says: the gain of the engine's actuator."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.specification import drive


class TorqueConstantError(SimulatedEffect):
    """The torque of a command times 1 + share."""

    id = "torque_constant_error"
    acts_on = ("joint",)
    defaults: ClassVar[Mapping[str, float]] = {"share": 0.1}  # [1]

    def edit(self, spec: Any) -> None:
        """Scales the gain of the drive."""
        spec.actuator(drive(self.owner)).gainprm[0] *= 1.0 + self.parameters["share"]
