# SPDX-License-Identifier: BSD-3-Clause
"""What several effects together make of a command or of a sensor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


def acting(effects: Sequence[SimulatedEffect], time: float, issued: Array) -> Array:
    """The command that acts, shape (n_joints,), for the one issued last."""
    for effect in effects:
        issued = effect.command(time, issued)
    return issued


def taken_at(effects: Sequence[SimulatedEffect], sensor: Sensor, stamps: Array) -> Array:
    """When samples with these stamps were really given out, shape (m,) [s]."""
    for effect in effects:
        stamps = effect.taken_at(sensor, stamps)
    return stamps


def age(effects: Sequence[SimulatedEffect], sensor: Sensor) -> Array:
    """How old readings are when they are given out, shape (channels,) [s]."""
    return sum((effect.age(sensor) for effect in effects), np.zeros(len(sensor.channels)))


def distort(effects: Sequence[SimulatedEffect], sensor: Sensor, stamps: Array, values: Array) -> Array:
    """What the effects make of true values, before bias, noise and quantization, shape (m, channels)."""
    for effect in effects:
        values = effect.reading(sensor, stamps, values)
    return values


def logged(effects: Sequence[SimulatedEffect], sensor: Sensor, stamps: Array, values: Array) -> Array:
    """What the bag holds of what a sensor gave out, shape (m, channels)."""
    for effect in effects:
        values = effect.logged(sensor, stamps, values)
    return values
