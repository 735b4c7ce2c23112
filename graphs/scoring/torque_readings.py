# SPDX-License-Identifier: BSD-3-Clause
"""Whether sensors of torques or currents read with a scale or an offset that the robot file has no parameters for.

Springs and friction bend to such readings, so that no residual is as large as the offset. One linear step with a scale
and an offset of each joint tells them all the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.sensors import Sensor, TorqueSensor

SURE = 5.0  # [sigma] of blocks and of white noise, whichever is larger
LARGE = (0.02, 0.5)  # smallest scale that is told, and smallest offset in sigmas of the sensor
SCALE, OFFSET = "scale", "offset"
CARD = Card("error of a sensor", "reading = (1 + scale) tau + offset", "", "", "", "")


@dataclass(frozen=True)
class TorqueReading:
    """What a sensor reads of a joint beside its torque.

    Attributes:
        parameter: that the robot file lacks, SENSOR.offset_JOINT or SENSOR.scale_JOINT.
        value, sigma: by one linear step; of a scale its value, 1 where it is right.
        unit: of both.
    """

    parameter: str
    value: float
    sigma: float
    unit: str


def torque_readings(test: ScoreTest) -> tuple[TorqueReading, ...]:
    """Scales and offsets that the recordings ask for and the robot has no free parameter of, surest first.

    Args:
        test: of the whole recordings, linearised at their solution with the noise used.
    """
    asked, names = [], list[dict[str, str]]()
    for sensor in test.robot.sensors.values():
        for j, known in enumerate(_sizes(sensor)):
            missing = {size: name for size, name in known.items() if name not in test.calibration.names}
            if missing:
                asked.append(_hypothesis(sensor, j, tuple(missing)))
                names.append(missing)
    found = list[tuple[float, TorqueReading]]()
    for step, missing in zip(test.steps(asked), names, strict=True):
        sensor = test.robot.sensors[step.hypothesis.here.owner]
        smallest = {SCALE: LARGE[0], OFFSET: LARGE[1] * float(np.min(sensor.sigmas))}
        for size, value, sigma in zip(step.hypothesis.sizes, step.sizes.tolist(), step.sigmas.tolist(), strict=True):
            if abs(value) > max(SURE * sigma, smallest[size.name]):
                whole = value + (1.0 if size.name == SCALE else 0.0)
                found.append((abs(value) / sigma, TorqueReading(missing[size.name], whole, sigma, size.unit)))
    return tuple(reading for _, reading in sorted(found, key=lambda one: -one[0]))


def _sizes(sensor: Sensor) -> list[dict[str, str]]:
    """Full names of the sizes of each joint; the scale of a current is the torque of one ampere."""
    if isinstance(sensor, TorqueSensor):
        return [dict(zip((SCALE, OFFSET), pair, strict=True)) for pair in sensor.parameters]
    return [{OFFSET: sensor.offset(joint)} for joint in sensor.joints] if isinstance(sensor, MotorCurrent) else []


def _hypothesis(sensor: Sensor, j: int, sizes: tuple[str, ...]) -> EffectHypothesis:
    """Errors of the readings of one joint."""

    def law(reading: Any, time: Any, p: Mapping[str, Any]) -> Any:
        error = np.zeros(reading.shape, dtype=complex)
        error[:, j] = p.get(SCALE, 0.0) * reading[:, j] + p.get(OFFSET, 0.0)
        return error

    known = {SCALE: EffectParameter(SCALE, "1", start=0.0, prior_sigma=1.0)}
    known[OFFSET] = EffectParameter(OFFSET, sensor.units[j], start=0.0, prior_sigma=1e3 * float(sensor.sigmas[j]))
    parameters = tuple(known[size] for size in sizes)
    effect = ReadingEffect(id="torque_sensor_error", card=CARD, parameters=parameters, law=law)
    return EffectHypothesis(EffectAt(effect, sensor.name), parameters)
