# SPDX-License-Identifier: BSD-3-Clause
"""A filter smooths encoder readings where the bag is written; the controller reads the encoders themselves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class EncoderFilter(SimulatedEffect):
    """Each reading is mixed with its neighbours, again and again, as often as the variance of the weights wants it.

    A mix (w, 1 - 2 w, w) of samples at a distance h has the variance 2 w h^2 and no lateness; w is at most a quarter.
    The low-pass of a driver is late, too: that part is encoder_delay.
    """

    id = "encoder_filter"
    acts_on = ("joint", "robot")
    defaults: ClassVar[Mapping[str, float]] = {"variance": 1e-4}  # [s^2]
    never_negative = ("variance",)

    def logged(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """Smoothed angles, shape (m, n_joints) [rad]; the first and the last stay as they are."""
        smoothed, channels = np.array(values), self.encoder_channels(sensor)
        if not channels or len(stamps) < 3:
            return smoothed
        wanted = self.parameters["variance"] / float(np.median(np.diff(stamps))) ** 2  # [samples^2]
        times = math.ceil(2.0 * wanted)
        for _ in range(times):
            part = smoothed[:, channels]
            part[1:-1] += wanted / (2.0 * times) * (part[:-2] - 2.0 * part[1:-1] + part[2:])
            smoothed[:, channels] = part
        return smoothed
