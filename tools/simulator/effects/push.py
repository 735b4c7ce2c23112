# SPDX-License-Identifier: BSD-3-Clause
"""Somebody pushes a link for a moment, and nobody logs it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.world.effect import Address, SimulatedEffect


class Push(SimulatedEffect):
    """A torque on the link of a joint from `time` on, for `duration`: half a sine, as of a hand."""

    id = "push"
    acts_on = ("joint",)
    defaults: ClassVar[Mapping[str, float]] = {"torque": 20.0, "time": 1.0, "duration": 0.3}  # [N m], [s], [s]
    never_negative = ("time",)
    above_zero = ("duration",)
    outside_catalogue = True

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Remembers the engine and the link's place in its vectors."""
        self._engine_data, self._place = data, address.link[self.owner]

    def torque(self) -> None:
        """The torque of this instant."""
        since = (self._engine_data.time - self.parameters["time"]) / self.parameters["duration"]
        if 0.0 <= since <= 1.0:
            self._engine_data.qfrc_passive[self._place] += self.parameters["torque"] * math.sin(math.pi * since)
