# SPDX-License-Identifier: BSD-3-Clause
"""Commands act later than they are stamped."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.simulator.world.effect import Address, SimulatedEffect

Array = NDArray[np.float64]


class CommandDelay(SimulatedEffect):
    """Each command acts a fixed time after its stamp; before the first one there was none."""

    id = "command_delay"
    acts_on = ("joint", "robot")
    defaults: ClassVar[Mapping[str, float]] = {"delay": 3e-3}  # [s]
    never_negative = ("delay",)

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Prepares a memory of as many fine steps as the delay is long."""
        steps = self.parameters["delay"] / float(model.opt.timestep)
        whole = int(steps + 1e-9)
        self._share = max(0.0, steps - whole)
        self._history = deque([np.zeros(self.robot.n)] * (whole + 2), maxlen=whole + 2)
        self._owned = [self.robot.joints.index(joint) for joint in self.joints]

    def command(self, time: float, issued: Array) -> Array:
        """The mean, over the coming fine step, of what was issued a delay ago."""
        self._history.append(issued)
        old = (1.0 - self._share) * self._history[1] + self._share * self._history[0]
        acting = np.array(issued)
        acting[self._owned] = old[self._owned]
        return acting
