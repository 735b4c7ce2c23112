# SPDX-License-Identifier: BSD-3-Clause
"""A tool that is not fixed rigidly to the last body but swings on springs about two axes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.inertia import long_axis
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.specification import link_body, set_linear

DISTANCE = 0.4  # [m] from the joint to the tool's mounting, along the long axis of the body


class SwingingTool(SimulatedEffect):
    """A point mass on a rod that two sprung hinges hold in line with the long axis of the last body."""

    id = "swinging_tool"
    acts_on = ("last joint",)
    defaults: ClassVar[Mapping[str, float]] = {
        "mass": 0.2,  # [kg]
        "length": 0.2,  # [m] from the mounting to the mass
        "frequency": 5.0,  # [Hz] of the swing on a body that stands still
        "damping_ratio": 0.05,
    }
    never_negative = ("mass", "damping_ratio")
    above_zero = ("length", "frequency")
    outside_catalogue = True

    def edit(self, spec: Any) -> None:
        """Hangs the tool on the last body."""
        p, mujoco = self.parameters, load_mujoco()
        if p["mass"] == 0:
            return
        body, name = spec.body(link_body(self.owner)), f"{self.owner}.tool"
        axis = long_axis(np.array(body.fullinertia))
        inertia, omega = p["mass"] * p["length"] ** 2, 2.0 * math.pi * p["frequency"]
        tool = body.add_body(
            name=name,
            pos=DISTANCE * axis,
            explicitinertial=True,
            mass=p["mass"],
            ipos=p["length"] * axis,
            inertia=[1e-6 * inertia] * 3,
        )
        first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        for suffix, across in (("x", first), ("y", np.cross(axis, first))):
            hinge = tool.add_joint(name=f"{name}_{suffix}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=across)
            set_linear(hinge, "stiffness", inertia * omega**2)
            set_linear(hinge, "damping", 2.0 * p["damping_ratio"] * inertia * omega)
