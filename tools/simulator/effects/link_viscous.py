# SPDX-License-Identifier: BSD-3-Clause
"""Viscous friction between the link and its base: the engine's own joint damping."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.specification import add_linear


class LinkViscous(SimulatedEffect):
    """Torque -coefficient v_link on the link."""

    id = "link_viscous"
    acts_on = ("joint",)
    built_in = True
    defaults: ClassVar[Mapping[str, float]] = {"coefficient": 1.0}  # [N m s/rad]
    never_negative = ("coefficient",)

    def edit(self, spec: Any) -> None:
        """Raises the damping of the link's joint."""
        add_linear(spec.joint(self.owner), "damping", self.parameters["coefficient"])
