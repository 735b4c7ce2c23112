# SPDX-License-Identifier: BSD-3-Clause
"""Does every value lie where its prior expects it? One that does not contradicts what the robot file knows.

A fit need not show it: on a link that does not tilt, the bias of an accelerometer takes a gravity of the wrong sign,
and the residuals are white. What it likely is follows from the kind of the value: gravity from the readings themselves,
turned axes from the rotation that was found, else a unit, a sign or a place.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.calibration.found_values import AT_BOUND, NEAR_BOUND
from jointscope.graphs.screening.felt_gravity import FELT_GRAVITY
from jointscope.graphs.screening.screen_all import screen_all
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.sensors import AXES
from jointscope.tools.presentation.numbers import significant

NAME = "Values where their priors expect them"
FAR = (5.0, 10.0)  # [sigma of the prior]: doubtful from the first, bad from the second
SHOWN = 2
RIGHT_ANGLES = 0.2  # [rad] within which a rotation is one of axes that were taken for others
NONE_FAR = "None is further than a few sigma from its prior."


@dataclass(frozen=True)
class FarValue:
    """A value far from its prior.

    Attributes:
        name: of the parameter.
        value, prior, prior_sigma: in its unit.
        unit: SI unit.
        distance: from the prior, in its sigmas; of positive values those of the logarithm.
    """

    name: str
    value: float
    prior: float
    prior_sigma: float
    unit: str
    distance: float

    @staticmethod
    def of(name: str, value: float, prior: float, prior_sigma: float, unit: str, positive: bool = False) -> FarValue:
        """How far a value is from its prior."""
        if positive and value > 0.0 and prior > 0.0:
            distance = abs(np.log(value / prior)) * prior / prior_sigma
        else:
            distance = abs(value - prior) / prior_sigma
        return FarValue(name, value, prior, prior_sigma, unit, float(distance))

    @property
    def owner(self) -> str:
        """Joint, sensor or motor."""
        return self.name.split(".", 1)[0]

    @property
    def sentence(self) -> str:
        """What was found, what was expected."""
        unit = f" {self.unit}" if self.unit and self.unit != "1" else ""
        return (
            f"{self.name} is {significant(self.value)}{unit}, {significant(self.distance, 2)} sigma from its prior "
            f"of {significant(self.prior)} ± {significant(self.prior_sigma, 2)}"
        )


def far_from_priors(result: CalibrationResult) -> tuple[str, str]:
    """A level of `judgement.LEVELS` and a sentence."""
    level, found = _level_of([*_parameters(result), *_biases(result)])
    if not found:
        return level, NONE_FAR
    # what readings at rest say of gravity explains whatever else was bent by it
    recordings = [bag.recording for bag in result.bags if bag.recording.streams and result.start.accelerometers]
    for notice in (notice for recording in recordings for notice in screen_all(recording, result.start)):
        if notice.kind == FELT_GRAVITY:
            own = sorted(found, key=lambda far: not far.name.startswith(f"{notice.stream}.bias."))
            return level, f"{_listed(own)}: {notice.text}."
    first, file = found[0], result.start.path.name
    return level, f"{_listed(found)}: {_likely(result, first)}. {_correct(first.owner, file)}"


def far_parameters(parameters: Mapping[str, Parameter], names: Iterable[str], file: str) -> tuple[str, str]:
    """The same of some calibrated parameters of a robot."""
    told = [parameters[n] for n in names if n in parameters and parameters[n].prior_sigma > 0.0]
    values = [FarValue.of(p.name, p.value, p.prior, p.prior_sigma, p.unit, p.positive) for p in told]
    level, found = _level_of(values)
    if not found:
        return level, NONE_FAR
    return level, f"{_listed(found)}: {_by_name(found[0].name)}. {_correct(found[0].owner, file)}"


def _level_of(values: Iterable[FarValue]) -> tuple[str, list[FarValue]]:
    found = sorted((v for v in values if v.distance > FAR[0]), key=lambda v: -v.distance)
    if not found:
        return "good", found
    return ("bad" if found[0].distance > FAR[1] else "warn"), found


def _listed(found: list[FarValue]) -> str:
    more = f" (and {len(found) - SHOWN} more)" if len(found) > SHOWN else ""
    return "; ".join(far.sentence for far in found[:SHOWN]) + more


def _parameters(result: CalibrationResult) -> Iterable[FarValue]:
    """All but biases; values at their bounds are told elsewhere."""
    known = result.robot.parameters
    for p in result.parameters:
        if p.prior_sigma > 0.0 and not p.derived and ".bias." not in p.name and p.note not in (AT_BOUND, NEAR_BOUND):
            positive = p.name in known and known[p.name].positive
            yield FarValue.of(p.name, p.value, p.prior, p.prior_sigma, p.unit, positive)


def _biases(result: CalibrationResult) -> Iterable[FarValue]:
    """Of every recording: each has its own."""
    for i, bag in enumerate(result.bags):
        behind = f" (bag {i + 1})" if len(result.bags) > 1 else ""
        for sensor in result.start.biased:
            if sensor.name in bag.calibration.biases and sensor.bias_prior_sigma > 0.0:
                for j, axis in enumerate(AXES):
                    value, prior = float(bag.calibration.biases[sensor.name][j]), float(sensor.bias[j])
                    name = f"{sensor.name}.bias.{axis}{behind}"
                    yield FarValue.of(name, value, prior, sensor.bias_prior_sigma, sensor.units[j])


def _likely(result: CalibrationResult, far: FarValue) -> str:
    """What such a value likely stands for."""
    if ".R_imu_body" in far.name and (said := _turned_axes(result.robot, far.owner)):
        return said
    return _by_name(far.name)


def _turned_axes(robot: Robot, name: str) -> str:
    """Axes that were taken for others; empty where the rotation is none by right angles."""
    gyro = next(gyro for gyro in robot.gyros if gyro.name == name)
    nearest = np.zeros((3, 3))
    left = np.abs(gyro.R_imu_body)
    for _ in AXES:
        row, column = np.unravel_index(int(np.argmax(left)), left.shape)
        nearest[row, column] = np.sign(gyro.R_imu_body[row, column])
        left[row], left[:, column] = -1.0, -1.0
    if np.linalg.det(nearest) < 0.0:
        return ""
    off = Rotation.from_matrix(nearest.T @ gyro.R_imu_body).magnitude()
    if off > RIGHT_ANGLES or np.abs(nearest - gyro.R_prior).max() < 0.5:
        return ""
    rows = ", ".join(f"[{', '.join(f'{element:.0f}' for element in row)}]" for row in nearest + 0.0)
    return f"the axes of {name} are most likely others than those of the robot file: R_imu_body [{rows}] is near"


def _by_name(name: str) -> str:
    """What a value of this name stands for where nothing else tells."""
    behind = name.split(".", 1)[-1]
    if ".bias." in name:
        return "readings in another unit or of other axes than the robot file says, or a body that never stops turning"
    if behind.startswith(("lever_", "offset_x", "offset_y", "offset_z")):
        return "the sensor or target sits on another body or elsewhere, or a length is in another unit"
    if behind.startswith(("offset", "scale")):
        return "readings in another unit, of another sign or of another joint than the robot file says"
    if behind.startswith("R_imu_body"):
        return "the sensor is turned otherwise or sits on another body than the robot file says"
    return "its prior or a measured signal is in another unit, or it stands for something that the model lacks"


def _correct(owner: str, file: str) -> str:
    return f"Correct {owner} in {file}; or, if the value may be, give it a wider prior_sigma there."
