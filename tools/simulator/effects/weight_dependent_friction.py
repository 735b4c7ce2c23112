# SPDX-License-Identifier: BSD-3-Clause
"""Friction of a rotor that grows with the weight that its rope holds, whatever the spring transmits meanwhile."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jointscope.tools.simulator.world.effect import Address
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.rotor_friction import RotorFriction


class WeightDependentFriction(RotorFriction):
    """`coefficient` |s| + `quadratic` s^2 more friction; s: what the engine finds for the arm at rest."""

    id = "weight_dependent_friction"
    acts_on = ("weighed elastic joint",)
    defaults: ClassVar[Mapping[str, float]] = {"coefficient": 0.1, "quadratic": 0.0}  # [1], [1/(N m)]
    never_negative = ("coefficient", "quadratic")

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Sets up a second arm that is always at rest."""
        super().bind(model, data, address)
        self._mujoco, self._model = load_mujoco(), model
        self._still, self._bias = self._mujoco.MjData(model), np.zeros(model.nv)
        # A motor that turns by one stretches its own spring by one: links take part with the inverse of these shares.
        joints = self.robot.joints
        unstretched = np.array([[self.shares[row].get(column, 0.0) for column in joints] for row in joints])
        self._weights = np.linalg.inv(unstretched)[:, joints.index(self.owner)]
        self._links = np.array([address.link[joint] for joint in joints])

    def extra(self, q: float, v: float) -> float:
        """Friction beyond that of the robot file [N m]."""
        self._still.qpos[:] = self._data.qpos
        self._mujoco.mj_kinematics(self._model, self._still)
        self._mujoco.mj_comPos(self._model, self._still)
        self._mujoco.mj_comVel(self._model, self._still)
        self._mujoco.mj_rne(self._model, self._still, 0, self._bias)
        load = float(self._weights @ self._bias[self._links])
        return self.parameters["coefficient"] * abs(load) + self.parameters["quadratic"] * load**2
