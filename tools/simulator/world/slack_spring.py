# SPDX-License-Identifier: BSD-3-Clause
"""A range of lengths in which the engine's spring between motor and link is slack and nothing is damped.

The slack spring is the engine's. The engine damps a tendon at all lengths, so that the damper of this one is taken
away and comes back as a torque wherever the spring is stretched. What bends the spring begins beyond the range, too.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np

from jointscope.robots.errors import EffectError
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.world.effect import Address, SimulatedEffect
from jointscope.tools.simulator.world.specification import set_linear, set_slack, spring_tendon


class SlackSpring(SimulatedEffect):
    """Spring and damper act only beyond a range of deflections; the spring there by the rest.

    Attributes:
        size: what is as wide as the range, for messages.
    """

    acts_on = ("elastic joint",)
    size: ClassVar[str]

    @abstractmethod
    def slack(self) -> tuple[float, float]:
        """The range of deflections q_link - q_motor, from below zero to above [rad]."""

    def edit(self, spec: Any) -> None:
        """Widens the range in which the spring is slack, and takes the damper away."""
        self._low, self._high = self.slack()
        width, travel = self._high - self._low, _travel(self.robot, self.owner)
        if width >= travel:
            raise EffectError(
                f"effect {self.id}@{self.owner}: a gap of {width:g} rad, {self.size}, is as wide as all that the motor "
                f"turns its joint ({travel:.3g} rad): its spring would never be stretched"
            )
        tendon = spec.tendon(spring_tendon(self.owner))
        if np.any(np.asarray(tendon.springlength) != 0.0):
            raise EffectError(f"effect {self.id}@{self.owner}: its spring has a dead zone already; give one of the two")
        set_slack(spec, self.owner, self._low, self._high)
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
        """Adds the damper where the spring is stretched."""
        length = sum(share * self._qpos[dof] for dof, share in self._terms)
        if self._low < length < self._high:
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
