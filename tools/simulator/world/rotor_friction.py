# SPDX-License-Identifier: BSD-3-Clause
"""What effects have in common that make a rotor's Coulomb friction depend on its state.

With dry friction, the engine's own friction loss is changed at every force evaluation, so that the rotor sticks as
firmly as it should at that moment. With smooth friction, the change enters as extra tanh(sharpness v).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from jointscope.tools.simulator.world.effect import Address, SimulatedEffect
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.specification import add_dry_friction, rotor_joint

PLACEHOLDER = 1e-9  # [N m] keeps a row in the engine's list of friction losses where the robot has no friction


class RotorFriction(SimulatedEffect):
    """More (or less) Coulomb friction on a rotor than the robot file says.

    Attributes:
        dof: index of the rotor in qpos and qvel, known after `bind`.
        sharpness: of tanh(sharpness v) [s/rad].
    """

    acts_on = ("joint",)

    def extra(self, q: float, v: float) -> float:
        """Friction beyond that of the robot file [N m] at angle [rad] and velocity [rad/s] of the rotor."""
        raise NotImplementedError

    def edit(self, spec: Any) -> None:
        """Makes sure that the rotor has a friction loss which can be changed while the engine runs."""
        if self.friction == "dry":
            add_dry_friction(spec.joint(rotor_joint(self.robot, self.owner)), PLACEHOLDER)
            # Islands work on copies of the friction losses, made before anything may change them.
            spec.option.disableflags |= int(getattr(load_mujoco().mjtDisableBit, "mjDSBL_ISLAND", 0))

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Remembers the rotor's state and its row among the friction losses, which come first of all constraints."""
        self.dof, self.sharpness = address.motor[self.owner], self.robot.sharpness_of(self.owner)
        self._data, self._qpos, self._qvel, self._passive = data, data.qpos, data.qvel, data.qfrc_passive
        self._row = int(np.count_nonzero(model.dof_frictionloss[: self.dof] > 0))

    def torque(self) -> None:
        """Changes the friction of this force evaluation."""
        v = float(self._qvel[self.dof])
        extra = self.extra(float(self._qpos[self.dof]), v)
        if self.friction == "smooth":
            self._passive[self.dof] -= extra * math.tanh(self.sharpness * v)
            return
        losses = self._data.efc_frictionloss  # in the engine's arena: asked for again every time
        losses[self._row] = max(0.0, losses[self._row] + extra)
