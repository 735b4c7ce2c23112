# SPDX-License-Identifier: BSD-3-Clause
"""Free play between motor and link: a range of lengths in which the engine's spring is slack and nothing is damped."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jointscope.robots.errors import EffectError
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.world.effect import Address, SimulatedEffect
from jointscope.tools.simulator.world.specification import set_linear, spring_tendon


class Backlash(SimulatedEffect):
    """Spring and damper act only where the deflection exceeds half_gap; the spring there by the rest.

    The slack spring is the engine's. The engine damps a tendon at all lengths, so that the damper of this one is taken
    away and comes back as a torque wherever the teeth touch.
    """

    id = "backlash"
    acts_on = ("elastic joint",)
    defaults: ClassVar[Mapping[str, float]] = {"half_gap": 0.012}  # [rad]
    never_negative = ("half_gap",)

    def edit(self, spec: Any) -> None:
        """Widens the range in which the spring is slack, and takes the damper away."""
        half_gap, tendon = self.parameters["half_gap"], spec.tendon(spring_tendon(self.owner))
        travel = _travel(self.robot, self.owner)
        if 2.0 * half_gap >= travel:
            raise EffectError(
                f"effect {self.id}@{self.owner}: a gap of {2.0 * half_gap:g} rad, twice half_gap, is as wide as all "
                f"that the motor turns its joint ({travel:.3g} rad): its spring would never be stretched"
            )
        tendon.springlength = [-half_gap, half_gap]
        self._damping = float(np.ravel(tendon.damping)[0])
        set_linear(tendon, "damping", 0.0)

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Remembers which coordinates make the length of the tendon, and how much each does."""
        tendon = model.tendon(spring_tendon(self.owner)).id
        wraps = range(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon])
        self._terms = [(int(model.jnt_dofadr[model.wrap_objid[i]]), float(model.wrap_prm[i])) for i in wraps]
        self._qpos, self._qvel = data.qpos, data.qvel
        self._receivers = data.qfrc_passive, data.qfrc_damper  # the second is what the gear's load is read from

    def torque(self) -> None:
        """Adds the damper where the teeth touch."""
        length = sum(share * self._qpos[dof] for dof, share in self._terms)
        if abs(length) < self.parameters["half_gap"]:
            return
        pull = self._damping * sum(share * self._qvel[dof] for dof, share in self._terms)
        for dof, share in self._terms:
            for receiver in self._receivers:
                receiver[dof] -= share * pull


def _travel(robot: Robot, joint: str) -> float:
    """How far the motor turns for the whole range of its joint, a full turn where it has no limits [rad]."""
    i = robot.joints.index(joint)
    limits = np.asarray(robot.tree.limits)[i]
    travel = float(np.ptp(limits)) if np.all(np.isfinite(limits)) else 2.0 * np.pi
    own = 1.0 if robot.transmission is None else abs(float(robot.transmission[i, i]))
    return travel / own if own > 0.0 else np.inf
