# SPDX-License-Identifier: BSD-3-Clause
"""Two ropes, each over a spring of two coils, the second of which takes part only beyond a deflection."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.loose_string import add_string

FAR = 1e6  # [rad] no deflection


class SpringRopes(SimulatedEffect):
    """Second coils join the linear spring: one side is stiffer than the other, and both harden in a corner.

    The estimator has no such law; its springs of pieces come near.
    """

    id = "spring_ropes"
    acts_on = ("elastic joint",)
    built_in = True
    outside_catalogue = True
    defaults: ClassVar[Mapping[str, float]] = {
        "forward_stiffness": 150.0,  # [N m/rad] of the coil in the rope that pulls the link back
        "forward_start": 0.005,  # [rad]
        "backward_stiffness": 400.0,
        "backward_start": 0.015,
    }
    never_negative = ("forward_stiffness", "forward_start", "backward_stiffness", "backward_start")

    def edit(self, spec: Any) -> None:
        """Adds two tendons, each of which is slack at all deflections of the other."""
        p, shares = self.parameters, self.shares[self.owner]
        ropes = {"forward": (-FAR, p["forward_start"]), "backward": (-p["backward_start"], FAR)}
        for side, slack in ropes.items():
            add_string(spec, f"{self.owner}.{side} rope", self.owner, shares, p[f"{side}_stiffness"], slack)
