# SPDX-License-Identifier: BSD-3-Clause
"""The robot's base is not level: the engine's gravity is turned by a quaternion of the engine itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.mujoco_module import load_mujoco


class GravityDirection(SimulatedEffect):
    """Gravity turned about x and y of the base by the vector (x, y, 0) [rad], for a base that stands upright."""

    id = "gravity_direction"
    acts_on = ("upright robot",)
    defaults: ClassVar[Mapping[str, float]] = {"x": 0.05, "y": -0.05}

    def edit(self, spec: Any) -> None:
        """Turns the vector of gravity."""
        turn = np.array([self.parameters["x"], self.parameters["y"], 0.0])
        angle, q_wxyz, g = float(np.linalg.norm(turn)), np.zeros(4), np.zeros(3)
        if angle == 0.0:
            return
        mujoco = load_mujoco()
        mujoco.mju_axisAngle2Quat(q_wxyz, turn / angle, angle)
        mujoco.mju_rotVecQuat(g, np.array(spec.option.gravity), q_wxyz)
        spec.option.gravity = g
