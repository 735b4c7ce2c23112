# SPDX-License-Identifier: BSD-3-Clause
"""The disc of an encoder is not centred on its shaft: the head sees it under another angle."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import LINK_SIDE
from jointscope.robots.errors import EffectError
from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class EncoderEccentricity(SimulatedEffect):
    """Adds cos cos(N q_motor) + sin sin(N q_motor) to first order, N the turns of the disc per turn of the joint.

    The disc's centre is off by e, as a share of the head's radius; seen from it, the head is at atan2 of a point on
    the circle, not on the circle's angle. At N = gear the disc sits on the motor, which is the default.
    """

    id = "encoder_eccentricity"
    acts_on = ("joint", "joint seen on the link")
    above_zero = ("order",)

    def default_parameters(self) -> Mapping[str, float]:
        """3e-4 rad at the joint, one period per turn of the motor; some degrees for a Hall sensor on the link."""
        if self.owner.endswith(LINK_SIDE):
            return {"cos": 0.02, "sin": 0.03, "cos2": -0.015, "sin2": 0.01}  # [rad]
        return {"cos": 1.8e-4, "sin": 2.4e-4, "order": self.robot.constants.get("motor.gear", 1.0)}  # [rad], [rad], [1]

    def _check(self, name: str, value: float) -> None:
        super()._check(name, value)
        e = self.parameters.get("order", 1.0) * math.hypot(self.parameters["cos"], self.parameters["sin"])
        if e >= 0.5:
            raise EffectError(f"effect {self.id}@{self.owner}: the disc would be off by {e:g} of its radius")

    def reading(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """Angles as the off-centre disc, or the Hall sensor, shows them."""
        if self.owner.endswith(LINK_SIDE):
            return self._by_hall_sensor(sensor, values)
        cos, sin, order = (self.parameters[name] for name in ("cos", "sin", "order"))
        e, phase = order * math.hypot(cos, sin), math.atan2(cos, sin)
        read = np.array(values)
        for channel in self.encoder_channels(sensor):
            disc = order * values[:, channel] + phase
            read[:, channel] += np.arctan2(e * np.sin(disc), 1.0 - e * np.cos(disc)) / order
        return read

    def _by_hall_sensor(self, sensor: Sensor, values: Array) -> Array:
        """Angle of a magnetic field whose two components have offsets, gains that differ and axes that are not square.

        Offsets show once per turn, the others twice: to first order cos cos q + sin sin q + cos2 cos 2q + sin2 sin 2q.
        """
        cos, sin, cos2, sin2 = (self.parameters[name] for name in ("cos", "sin", "cos2", "sin2"))
        read = np.array(values)
        for channel in self.encoder_channels(sensor):
            q = values[:, channel]
            x = (1.0 - sin2) * np.cos(q) + cos2 * np.sin(q) - sin
            y = (1.0 + sin2) * np.sin(q) + cos2 * np.cos(q) + cos
            # the turn that the field has left behind is the joint's
            read[:, channel] += np.arctan2(y * np.cos(q) - x * np.sin(q), x * np.cos(q) + y * np.sin(q))
        return read
