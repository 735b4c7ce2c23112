# SPDX-License-Identifier: BSD-3-Clause
"""What is true in a simulation: which values are used, and how they are told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from jointscope.robots.errors import SimulationError
from jointscope.robots.files.effects_at_once import without_effects
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.loop.sensing import MountedAccelerometer, MountedGyro
from jointscope.tools.simulator.world.effect import SimulatedEffect

TINY = 1e-12  # in the unit of the parameter; inertia and stiffness must be above


def true_robot(robot: Robot, overrides: Mapping[str, float]) -> Robot:
    """The robot with its true parameters: published values where there are some, then the overrides.

    Effects of the robot file are no part of it: what is simulated is named, and has the simulator's own form.

    Args:
        robot: the robot of the file.
        overrides: values by full name.

    Raises:
        RobotError: an override names no parameter.
        SimulationError: a value is impossible.
    """
    robot.need_motion()
    robot = without_effects(robot)
    published = {p.name: p.published for p in robot.parameters.values() if p.published is not None}
    truth = robot.with_values({**published, **overrides})
    places = {name for sensor in robot.accelerometers for name in sensor.own}
    places |= {name for target in robot.targets for name in target.own}
    for parameter in truth.parameters.values():
        friction_or_damping = parameter.name.endswith((".coulomb_torque", ".damping", ".k_mi"))
        signed = parameter.name in places or not parameter.positive
        least = -np.inf if signed else 0.0 if friction_or_damping else TINY
        if not np.isfinite(parameter.value) or parameter.value < least:
            raise SimulationError(f"{parameter.name}: cannot be simulated with {parameter.value:g} {parameter.unit}")
    return truth


def true_parameters(
    robot: Robot,
    gyros: Sequence[MountedGyro],
    accelerometers: Sequence[MountedAccelerometer],
    effects: Sequence[SimulatedEffect],
) -> dict[str, float | list[float] | list[list[float]]]:
    """All true values by full name: OWNER.PARAMETER, OWNER.EFFECT.PARAMETER, IMU.bias and IMU.R_imu_body."""
    values: dict[str, Any] = {parameter.name: parameter.value for parameter in robot.parameters.values()}
    for gyro in gyros:
        values[f"{gyro.sensor.name}.bias"] = gyro.bias.tolist()
        values[f"{gyro.sensor.name}.R_imu_body"] = gyro.R_imu_body.tolist()
    for accelerometer in accelerometers:
        values[f"{accelerometer.sensor.name}.bias"] = accelerometer.bias.tolist()
    for effect in effects:
        for name, value in effect.parameters.items():
            values[f"{effect.owner}.{effect.id}.{name}"] = value
    return values


def effect_records(effects: Sequence[SimulatedEffect]) -> list[dict[str, Any]]:
    """Id, owner, kind ("catalogue", "outside" the estimator's catalogue, "mistake") and parameters of each effect."""
    return [{"effect": e.id, "owner": e.owner, "kind": e.kind(), "parameters": dict(e.parameters)} for e in effects]
