# SPDX-License-Identifier: BSD-3-Clause
"""The magnet of an encoder is loose on its shaft: a pin in a slot takes it along, whichever end of it pushes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import LINK_SIDE
from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import Address, SimulatedEffect

Array = NDArray[np.float64]


class EncoderHysteresis(SimulatedEffect):
    """Angle of a magnet that a pin pushes along, followed in the fine steps of the engine, not from sample to sample.

    The slot is `2 half_play` long; the pin is in its middle when the run begins.
    """

    id = "encoder_hysteresis"
    acts_on = ("joint", "joint seen on the link")
    defaults: ClassVar[Mapping[str, float]] = {"half_play": 2e-3}  # [rad]
    never_negative = ("half_play",)

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Finds the shaft."""
        on_link = self.owner.endswith(LINK_SIDE)
        joint = self.owner.removesuffix(LINK_SIDE)
        self._data, self._shaft = data, (address.link if on_link else address.motor)[joint]
        self._magnet: float | None = None
        self._times, self._behind = list[float](), list[float]()

    def command(self, time: float, issued: Array) -> Array:
        """Moves the magnet to where the shaft has pushed it by now; the command is left alone."""
        shaft = float(self._data.qpos[self._shaft])
        magnet = shaft if self._magnet is None else self._magnet
        overrun = shaft - magnet
        if abs(overrun) > self.parameters["half_play"]:
            push = abs(overrun) - self.parameters["half_play"]
            magnet += push if overrun > 0.0 else -push
        self._magnet = magnet
        self._times.append(time)
        self._behind.append(shaft - magnet)
        return issued

    def reading(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """Angles of the magnet, shape (m, n_joints) [rad]."""
        read, channels = np.array(values), self.encoder_channels(sensor)
        if channels and self._times:
            newest = len(stamps) == 1 and stamps[0] >= self._times[-1]
            behind = self._behind[-1] if newest else np.interp(stamps, self._times, self._behind)
            read[:, channels] -= np.reshape(behind, (-1, 1))
        return read
