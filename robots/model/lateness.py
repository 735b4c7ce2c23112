# SPDX-License-Identifier: BSD-3-Clause
"""How late the stamps of a sensor's channels are, and over what time their readings are means, by a robot's effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.smoothed_reading import SmoothedReading
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.sensors import Accelerometer, MotorEncoder, Sensor

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lateness:
    """Lateness and smoothing of m samples.

    Attributes:
        effects: what makes them late or smooth.
        stamps: times since the start of the recording, shape (m,) [s].
        anchor: lateness at which the samples were placed, shape (m,) [s].
    """

    effects: tuple[EffectAt, ...]
    stamps: Array
    anchor: Array

    @staticmethod
    def of(robot: Robot, effects: tuple[EffectAt, ...], stamps: Array) -> Lateness:
        """Samples placed where the robot's present values say."""
        nowhere = Lateness(effects, stamps, np.zeros(len(stamps)))
        return replace(nowhere, anchor=nowhere.since_anchor(robot.values)[0])

    def since_anchor(self, values: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
        """Lateness beyond the anchor and its derivatives by parameters, by full name, shape (m,) each [s]."""
        late, slopes = -self.anchor, dict[str, Array]()
        for here in self.effects:
            if not isinstance(here.effect, TimeShift):
                continue
            own = {p.name: values[here.parameter(p.name)] for p in here.effect.parameters}
            added, by = here.effect.late(self.stamps, own)
            late = late + added
            slopes |= {here.parameter(name): slope for name, slope in by.items()}
        return late, slopes

    def variance(self, values: Mapping[str, float]) -> tuple[float, dict[str, float]]:
        """Variance of the weights of filters, and its derivatives by parameters, by full name [s^2]."""
        names = [
            here.parameter(here.effect.variance) for here in self.effects if isinstance(here.effect, SmoothedReading)
        ]
        return sum(values[name] for name in names), dict.fromkeys(names, 1.0)


def taken(robot: Robot, name: str, effects: tuple[EffectAt, ...], stamps: Array) -> Array:
    """When samples of a sensor were really taken, by effects and by its own delay, shape (m,) [s]."""
    return stamps - Lateness.of(robot, effects, stamps).anchor - own_delay(robot.sensors[name])


def own_delay(sensor: Sensor) -> float:
    """Delay that a sensor has without any effect [s]."""
    return sensor.delay if isinstance(sensor, MotorCurrent) else 0.0


def late_channels(robot: Robot, name: str) -> list[tuple[NDArray[np.intp], tuple[EffectAt, ...]]]:
    """Channels of a sensor in groups of the same lateness and smoothing, and what makes each group so."""
    sensor = robot.sensors[name]
    groups: dict[tuple[str, ...], tuple[list[int], tuple[EffectAt, ...]]] = {}
    for j in range(len(sensor.channels)):
        effects = tuple(here for here in robot.effects if shifts(here, robot, name, j) or smooths(here, robot, name, j))
        groups.setdefault(tuple(here.label for here in effects), ([], effects))[0].append(j)
    return [(np.array(channels, dtype=np.intp), effects) for channels, effects in groups.values()]


def shifts(here: EffectAt, robot: Robot, name: str, channel: int) -> bool:
    """Whether an effect makes a channel late."""
    if not isinstance(here.effect, TimeShift):
        return False
    sensor = robot.sensors[name]
    encoder = isinstance(sensor, MotorEncoder)
    if isinstance(sensor, Accelerometer) and here.effect.sensors == "all" and here.owner == sensor.gyro:
        return sensor.source.topic == robot.sensors[sensor.gyro].source.topic  # one message, one stamp
    if here.owner == "robot":
        return here.effect.sensors == "all" or (here.effect.sensors == "encoder") == encoder
    return (encoder and robot.joints[channel] == here.owner) or here.owner == name


def smooths(here: EffectAt, robot: Robot, name: str, channel: int) -> bool:
    """Whether an effect smooths a channel."""
    if not isinstance(here.effect, SmoothedReading) or not isinstance(robot.sensors[name], MotorEncoder):
        return False
    return here.owner in ("robot", robot.joints[channel])
