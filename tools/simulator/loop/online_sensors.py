# SPDX-License-Identifier: BSD-3-Clause
"""All sensors as they reach a controller while the engine runs: sample by sample, late and incomplete as they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.simulator.loop.sampled_sensor import SampledSensor
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]

SAME_TIME = 1e-9  # [s] a sample of this very moment is there


@dataclass(frozen=True)
class Sample:
    """One message of a sensor.

    Attributes:
        sensor: its name.
        stamp: time of measurement by the clock of the sensor [s].
        values: shape (c,), SI unit of the sensor.
    """

    sensor: str
    stamp: float
    values: Array


class OnlineSensors:
    """Hands out each sample once, at the first call after its arrival.

    What the sensors give out is what `SampledSensor.stream` records, but for mistakes that are made in the bag only.

    Args:
        sensors: with the times of their samples.
    """

    def __init__(self, sensors: Sequence[SampledSensor]):
        self._sensors = sensors
        self._arrivals, self._orders = [], []
        for sensor in sensors:
            arrival = np.where(sensor.kept, sensor.taken + (sensor.received - sensor.stamps), np.inf)
            order = np.argsort(arrival, kind="stable")
            self._orders.append(order)
            self._arrivals.append(arrival[order])
        self._next = [0] * len(sensors)

    def arrived(self, now: float, past: Trajectory) -> list[Sample]:
        """The samples that have come since the last call, in the order of their arrival.

        Args:
            now: [s].
            past: everything that has happened until now.
        """
        found: list[tuple[float, Sample]] = []
        for i, sensor in enumerate(self._sensors):
            first = self._next[i]
            last = int(np.searchsorted(self._arrivals[i], now + SAME_TIME, side="right"))
            if last == first:
                continue
            self._next[i] = last
            rows = self._orders[i][first:last]
            values = sensor.given_out(past, rows)
            name, stamps = sensor.sensor.name, sensor.stamps[rows].tolist()
            samples = (Sample(name, stamp, value) for stamp, value in zip(stamps, values, strict=True))
            found += zip(self._arrivals[i][first:last].tolist(), samples, strict=True)
        found.sort(key=lambda arrival_and_sample: arrival_and_sample[0])
        return [sample for _, sample in found]
