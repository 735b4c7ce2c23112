# SPDX-License-Identifier: BSD-3-Clause
"""The link before a joint is twisted: the engine's body that the joint moves is attached askew."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jointscope.robots.errors import EffectError
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.specification import link_body

MOST = np.pi / 4  # [rad] beyond, a joint turns about another axis


class AxisMisalignment(SimulatedEffect):
    """The body turned about the two coordinate axes of its frame across the joint's axis, by one turn (x, y) [rad]."""

    id = "axis_misalignment"
    acts_on = ("joint",)
    built_in = True
    defaults: ClassVar[Mapping[str, float]] = {"x": 0.089, "y": 0.0}  # 5.1 degrees

    def _check(self, name: str, value: float) -> None:
        super()._check(name, value)
        if abs(value) >= MOST:
            raise EffectError(f"effect {self.id}@{self.owner}: {name}: expected below {MOST:.3g} rad, got {value:g}")

    def edit(self, spec: Any) -> None:
        """Turns the frame of the body, with the joint's axis in it."""
        body, axis = spec.body(link_body(self.owner)), np.array(spec.joint(self.owner).axis)
        turn = np.zeros(3)
        turn[np.sort(np.argsort(np.abs(axis))[:2])] = self.parameters["x"], self.parameters["y"]
        angle, by, after = float(np.linalg.norm(turn)), np.zeros(4), np.zeros(4)
        if angle == 0.0:
            return
        mujoco = load_mujoco()
        mujoco.mju_axisAngle2Quat(by, turn / angle, angle)
        mujoco.mju_mulQuat(after, np.array(body.quat), by)
        body.quat = after
