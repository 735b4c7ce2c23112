# SPDX-License-Identifier: BSD-3-Clause
"""Friction of a rotor that grows with the weight that its rope holds, whatever the spring transmits meanwhile.

What hangs on a link is weight, too.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

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
        """Sets up a second arm that is always at rest; all effects of one robot share it."""
        super().bind(model, data, address)
        self._at_rest = _ArmAtRest.of(model, data)
        # A motor that turns by one stretches its own spring by one: links take part with the inverse of these shares.
        joints = self.robot.joints
        unstretched = np.array([[self.shares[row].get(column, 0.0) for column in joints] for row in joints])
        self._weights = np.linalg.inv(unstretched)[:, joints.index(self.owner)]
        self._links = np.array([address.link[joint] for joint in joints])

    def extra(self, q: float, v: float) -> float:
        """Friction beyond that of the robot file [N m]."""
        load = float(self._weights @ self._at_rest.torques()[self._links])
        return self.parameters["coefficient"] * abs(load) + self.parameters["quadratic"] * load**2


class _ArmAtRest:
    """What it takes to hold an arm, and what hangs on it, wherever it is just now."""

    _latest: ClassVar[_ArmAtRest | None] = None

    def __init__(self, model: Any, data: Any):
        self._mujoco, self._model, self._data = load_mujoco(), model, data
        self._still, self._looked_at = self._mujoco.MjData(model), b""
        self._torques, self._hung = np.zeros(model.nv), np.zeros(model.nv)

    @classmethod
    def of(cls, model: Any, data: Any) -> _ArmAtRest:
        """The one of an engine; effects are bound one after the other."""
        if cls._latest is None or cls._latest._data is not data:
            cls._latest = cls(model, data)
        return cls._latest

    def torques(self) -> NDArray[np.float64]:
        """On all coordinates, shape (nv,) [N m]."""
        mujoco, model, still, applied = self._mujoco, self._model, self._still, self._data.xfrc_applied
        now = self._data.qpos.tobytes() + applied.tobytes()
        if now == self._looked_at:
            return self._torques
        self._looked_at = now
        still.qpos[:] = self._data.qpos
        mujoco.mj_kinematics(model, still)
        mujoco.mj_comPos(model, still)
        mujoco.mj_comVel(model, still)
        mujoco.mj_rne(model, still, 0, self._torques)
        if applied.any():
            self._hung[:] = 0.0
            for body in np.flatnonzero(applied.any(axis=1)).tolist():
                force, moment, point = applied[body, :3], applied[body, 3:], still.xipos[body]
                mujoco.mj_applyFT(model, still, force, moment, point, body, self._hung)
            self._torques -= self._hung
        return self._torques
