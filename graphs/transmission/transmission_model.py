# SPDX-License-Identifier: BSD-3-Clause
"""A robot with free links, fitted: sizes of its effects, mountings of its gyros, and what is left of each equation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from jointscope.graphs.transmission.candidates import Candidate, columns_of, present
from jointscope.graphs.transmission.equation import Equation, delay_name, equations
from jointscope.graphs.transmission.position_ripple import EFFECT as RIPPLE
from jointscope.graphs.transmission.position_ripple import with_order
from jointscope.graphs.transmission.regression import Choose, errors, everything, fitted, parts, spread
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Sensor
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

ROUNDS = 6  # mountings and delays of gyros are not linear
LARGEST_TURN = 0.3  # [rad] of a mounting in one round


@dataclass(frozen=True)
class TransmissionModel:
    """A model and its fit.

    Attributes:
        robot: with the mountings of its gyros; its effects are those of `chosen`.
        chosen: effects.
        names: names of the columns.
        sizes: what multiplies them, shape (p,); mountings are zero, the robot has them.
        delays: delays of gyros at which the equations were taken, by full name [s].
    """

    robot: Robot
    chosen: tuple[Candidate, ...]
    names: tuple[str, ...]
    sizes: Array
    delays: Mapping[str, float]

    def equations(self, recordings: Sequence[Recording]) -> list[Equation]:
        """The equations of recordings, gyro delays, mountings and orders of ripples in them."""
        found = [e for recording in recordings for e in equations(recording, self.robot, self.delays)]
        for candidate in self.chosen:
            found = with_order(found, candidate)
        return found

    def size(self, name: str) -> float:
        """The size of one column."""
        return float(self.sizes[self.names.index(name)]) + self.delays.get(name, 0.0)

    def errors(self, recordings: Sequence[Recording], choose: Choose = everything) -> dict[str, float]:
        """What is left of each equation [sigma]; zeros and biases are the recording's own."""
        return errors(parts(self.equations(recordings), self.names, choose), self.sizes)

    def sigmas(self, recordings: Sequence[Recording]) -> dict[str, float]:
        """Standard deviations of the sizes, by full name."""
        found = spread(self.equations(recordings), self.names)
        return dict(zip(self.names, found.tolist(), strict=True))

    def left(self, recording: Recording, name: str) -> tuple[Equation, Array, Array]:
        """One equation, its error without constants as measured, and what is left, shape (m, c) each [unit]."""
        (equation,) = [e for e in self.equations([recording]) if e.name == name]
        (piece,) = parts([equation], self.names)
        before = (piece.error * equation.sigma).reshape(equation.error.shape)
        explained = (piece.columns @ self.sizes * equation.sigma).reshape(equation.error.shape)
        return equation, before, before - explained


def fit(
    robot: Robot,
    recordings: Sequence[Recording],
    chosen: Sequence[Candidate] | None = None,
    choose: Choose = everything,
) -> TransmissionModel:
    """Fits a model to recordings.

    Args:
        robot: the robot.
        recordings: training recordings.
        chosen: its effects; those of the robot file if None.
        choose: which samples may be used.
    """
    chosen = tuple(present(robot) if chosen is None else chosen)
    names = tuple(columns_of(robot, chosen))
    delays: dict[str, float] = {}
    sizes = np.zeros(len(names))
    for _ in range(ROUNDS if robot.gyros else 1):
        model = TransmissionModel(robot, chosen, names, sizes, delays)
        found = fitted(parts(model.equations(recordings), names, choose))
        robot, delays, sizes = _moved(robot, names, found, delays)
    return TransmissionModel(robot, chosen, names, sizes, delays)


def _moved(
    robot: Robot, names: Sequence[str], found: Array, delays: Mapping[str, float]
) -> tuple[Robot, dict[str, float], Array]:
    """Mountings and delays where the fit wants them; their columns are zero there."""
    table, sizes = dict(zip(names, found.tolist(), strict=True)), found.copy()
    sensors: dict[str, Sensor] = {}
    new = dict(delays)
    for gyro in robot.gyros:
        turn = np.array([table[f"{gyro.name}.R_imu_body.{axis}"] for axis in "xyz"])
        turn *= min(1.0, LARGEST_TURN / (float(np.linalg.norm(turn)) + 1e-12))
        sensors[gyro.name] = replace(gyro, R_imu_body=gyro.R_imu_body @ Rotation.from_rotvec(turn).as_matrix())
        if delay_name(gyro) in table:
            new[delay_name(gyro)] = new.get(delay_name(gyro), 0.0) + table[delay_name(gyro)]
    for k, name in enumerate(names):
        if ".R_imu_body." in name or name in new:
            sizes[k] = 0.0
    return robot.with_sensors(sensors), new, sizes


def with_found_effects(model: TransmissionModel, sigmas: Mapping[str, float]) -> Robot:
    """The robot file's robot with the effects of a model at their sizes."""
    robot = model.robot
    for candidate in model.chosen:
        values = {name.rsplit(".", 1)[1]: physical(model, name) for name in candidate.sizes}
        if candidate.effect == RIPPLE:
            values["order"] = candidate.order
        if not robot.has_effect(candidate.effect, candidate.owner):
            robot = add_effect(robot, candidate.label, values)
        robot = robot.with_values({f"{candidate.owner}.{candidate.effect}.{size}": v for size, v in values.items()})
        friction = f"{candidate.owner}.coulomb_torque"
        if friction in model.names:
            robot = robot.with_values({friction: max(physical(model, friction), 1e-9)})
    parameters = {
        name: replace(p, sigma=_sigma(model, name, sigmas)) if name in model.names else p
        for name, p in robot.parameters.items()
    }
    return replace(robot, parameters=parameters)


def physical(model: TransmissionModel, name: str) -> float:
    """A size in the unit of its parameter: torques are seen through the compliance."""
    return model.size(name) * _per_size(model, name)


def _per_size(model: TransmissionModel, name: str) -> float:
    owner, law = name.split(".")[0], name.split(".", 1)[1]
    if law in ("coulomb_torque", "motor_viscous.coefficient", "spring_cubic.stiffness"):
        compliance = model.size(f"{owner}.joint_elasticity.compliance")
        return 1.0 / compliance ** (4 if law.startswith("spring") else 1)
    return 1.0


def _sigma(model: TransmissionModel, name: str, sigmas: Mapping[str, float]) -> float | None:
    found = abs(sigmas[name] * _per_size(model, name))
    return found if found > 0.0 else None
