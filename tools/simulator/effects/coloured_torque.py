# SPDX-License-Identifier: BSD-3-Clause
"""A random torque with a memory on one rotor, as gears and cables make it: a Gauss-Markov process."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.simulator.world.effect import Address, SimulatedEffect

Array = NDArray[np.float64]


class ColouredTorque(SimulatedEffect):
    """Standard deviation `torque`, time constant `memory`; every robot's own by `seed`."""

    id = "coloured_torque"
    acts_on = ("joint",)
    defaults: ClassVar[Mapping[str, float]] = {"torque": 0.5, "memory": 0.05, "seed": 1.0}  # [N m], [s]
    never_negative = ("torque", "seed")
    above_zero = ("memory",)
    outside_catalogue = True

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Remembers where the rotor is, and begins in the middle of nowhere."""
        self._data, self._motor = data, address.motor[self.owner]
        self._random = np.random.default_rng([int(self.parameters["seed"]), self.robot.joints.index(self.owner)])
        self._now, self._time = self._random.normal(), 0.0

    def command(self, time: float, issued: Array) -> Array:
        """Lets the process go on; the command stays what it is."""
        keep = math.exp(-max(time - self._time, 0.0) / self.parameters["memory"])
        self._now, self._time = keep * self._now + math.sqrt(1.0 - keep**2) * self._random.normal(), time
        return issued

    def torque(self) -> None:
        """Adds the present value."""
        self._data.qfrc_passive[self._motor] += self.parameters["torque"] * self._now
