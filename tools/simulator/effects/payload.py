# SPDX-License-Identifier: BSD-3-Clause
"""Something is fixed to the last body that the URDF does not know: a point mass on its long axis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.inertia import long_axis
from jointscope.tools.simulator.world.specification import link_body

DISTANCE = 0.5  # [m] from the joint; only mass times its square is told, so the mass follows


class Payload(SimulatedEffect):
    """A point mass that adds `inertia` about both axes across the long one."""

    id = "payload"
    acts_on = ("last joint",)
    defaults: ClassVar[Mapping[str, float]] = {"inertia": 0.03}  # [kg m2]
    never_negative = ("inertia",)

    def edit(self, spec: Any) -> None:
        """Welds a body to the last one."""
        if self.parameters["inertia"] == 0:
            return
        body = spec.body(link_body(self.owner))
        axis = long_axis(np.array(body.fullinertia))
        body.add_body(
            name=f"{self.owner}.payload",
            pos=DISTANCE * axis,
            ipos=np.zeros(3),  # the engine would take `pos` a second time
            explicitinertial=True,
            mass=self.parameters["inertia"] / DISTANCE**2,
            inertia=[1e-9] * 3,  # [kg m2] a point, as near as the engine allows
        )
