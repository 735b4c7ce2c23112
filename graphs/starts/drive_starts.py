# SPDX-License-Identifier: BSD-3-Clause
"""Where a calibration begins: parameters of the drives of rigid joints, from the regression or from the robot file.

The regression knows torques by a constant, inertia, dry and viscous friction, and leaves alone what is fixed. The file
keeps the word where its values explain the motion better, and, where a joint has effects that the regression does
not know, where they explain it nearly as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.starts.command_limits import command_limits
from jointscope.graphs.starts.drive_regression import (
    DRY,
    GAIN,
    INERTIA,
    VISCOUS,
    DriveEquation,
    Driven,
    Value,
    drive_equations,
)
from jointscope.robots.dynamics.command_path import law_of
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.recordings.recording import Recording, Stream

Array = NDArray[np.float64]

OPPOSITE = 20.0  # [sigma] from which a drive turns against its command
EXPLAINED = 0.7  # of the torque that may be missing where that is believed
TOLD = 2.0  # [sigma] above zero from which a value is one
PLAIN = "motor_viscous"  # the effect that the regression knows
LIMIT = "command_limit"  # and the one that its commands have passed
WITHIN = 0.6  # of the largest command, from where a calibration looks for a limit that the regression does not show
NEARLY = 3.0  # times the missing torque with which a file of a joint with further effects keeps the word


def with_drive_starts(problems: Sequence[BagProblem], calibration: Calibration) -> Calibration:
    """The calibration with values for the drives of rigid joints that the recordings ask for.

    Args:
        problems: whole recordings.
        calibration: the values of the robot file.

    Raises:
        RecordingError: a joint moves against its command.
    """
    robot = problems[0].robot
    rigid = [joint for joint in robot.joints if joint not in robot.layout.motors]
    recordings = [problem.recording for problem in problems]
    levels = _limit_starts(robot, recordings)
    if not rigid:
        return _with_values(calibration, levels)
    at_levels = {name: replace(robot.parameter(name), value=level) for name, level in levels.items()}
    robot = replace(robot, parameters={**robot.parameters, **at_levels})
    equations = equations_of(robot, recordings)
    found: dict[str, list[Value]] = {}
    for joint, equation in zip(robot.joints, equations, strict=True):
        if joint in rigid:
            _check_sign(joint, equation)
            for name, value in _joint_starts(robot, joint, equation).items():
                found.setdefault(name, []).append(value)
    return _with_values(calibration, levels | {name: _mean(values) for name, values in found.items()})


def equations_of(robot: Robot, recordings: Sequence[Recording], delay: float = 0.0) -> list[DriveEquation]:
    """The windowed equation of every joint; commands act a time `delay` [s] after their stamps."""
    held, sharpness, sigmas = robot.command_held, robot.friction_sharpness(), robot.motor_encoder.sigmas
    return drive_equations(robot.tree, driven_joints(robot, recordings, delay), sigmas, held=held, sharpness=sharpness)


def driven_joints(robot: Robot, recordings: Sequence[Recording], delay: float = 0.0) -> list[Driven]:
    """What of each recording tells about drives; commands act a time `delay` [s] after their stamps."""
    encoder, driven = robot.motor_encoder, []
    for recording in recordings:
        stream, command = recording.streams[encoder.name], recording.command
        positions = replace(stream, values=stream.values - encoder.zero)
        later = replace(command, times=command.times + delay)
        driven.append(Driven(positions, limited_by(robot, later), recording.left_out))
    return driven


def limited_by(robot: Robot, command: Stream) -> Stream:
    """What drives give of a command that saturate, as the robot has it."""
    own = [here for here in robot.effects if here.effect.id == LIMIT]
    values = command.values.copy() if own else command.values
    for here in own:
        j, sizes = robot.joints.index(here.owner), {p.name: here.parameter(p.name) for p in here.effect.parameters}
        now = {name: robot.parameter(full).value for name, full in sizes.items()}
        values[:, j] = law_of(here)(command.times, values[:, j], now)[0]
    return replace(command, values=values)


def _limit_starts(robot: Robot, recordings: Sequence[Recording]) -> dict[str, float]:
    """Levels at which drives saturate that may, by the name of the parameter, where the recordings show them."""
    asked = [joint for joint in robot.joints if robot.has_effect(LIMIT, joint)]
    free = [joint for joint in asked if not robot.parameter(f"{joint}.{LIMIT}.limit").fixed]
    if not free:
        return {}
    without = replace(robot, effects=tuple(here for here in robot.effects if here.effect.id != LIMIT))
    found = command_limits(
        robot.tree, driven_joints(without, recordings), robot.motor_encoder.sigmas, held=robot.command_held
    )
    table = dict(zip(robot.joints, found, strict=True))
    starts = {f"{joint}.{LIMIT}.limit": limit.level for joint in free if (limit := table[joint]) is not None}
    for joint in free:
        name, j = f"{joint}.{LIMIT}.limit", robot.joints.index(joint)
        sizes = np.abs(np.concatenate([recording.command.values[:, j] for recording in recordings]))
        if name not in starts and robot.parameter(name).value > WITHIN * float(sizes.max()):
            starts[name] = WITHIN * float(sizes.max())  # beyond all commands nothing pulls at it
    return starts


def _joint_starts(robot: Robot, joint: str, equation: DriveEquation) -> dict[str, Value]:
    """Values by the name of the parameter; empty where the file explains the motion as well."""
    parts = parts_of(robot, joint)
    file = {GAIN: 1.0, **{law: sum(factor * p.value for p, factor in some) for law, some in parts.items()}}
    known = {law: value for law, value in file.items() if all(p.fixed for p, _ in parts.get(law, ()))}
    if VISCOUS not in parts:
        known[VISCOUS] = 0.0
    values = equation.solve(known)
    if not values:
        return {}
    allowed = NEARLY if _has_more(robot, joint) else 1.0
    full = {**file, **known, **{law: value.value for law, value in values.items()}}
    if equation.missing(file) <= allowed * equation.missing(full):
        return {}
    starts = {}
    for law, value in values.items():
        *others, (last, factor) = sorted(parts[law], key=lambda part: not part[0].fixed)
        rest = value.value - sum(f * p.value for p, f in others)
        start = Value(rest / factor, value.sigma / factor)
        if not last.positive or start.value > TOLD * start.sigma:
            starts[last.name] = start
    return starts


def parts_of(robot: Robot, joint: str) -> dict[str, list[tuple[Parameter, float]]]:
    """For each value of the regression the parameters that it is the sum of, each with a factor."""
    parts = {DRY: [(robot.drive_parameter(joint, "coulomb_torque"), 1.0)]}
    parts[INERTIA] = [(robot.drive_parameter(joint, "inertia"), 1.0)]
    if robot.drive_gain is not None:
        parts[GAIN] = [(robot.drive_parameter(joint, robot.drive_gain), robot.command_volts)]
    viscous = [(robot.drive_parameter(joint, "k_mi"), 1.0)] if "k_mi" in robot.drive_laws else []
    if robot.has_effect(PLAIN, joint):
        viscous.insert(0, (robot.parameter(f"{joint}.{PLAIN}.coefficient"), 1.0))
    return {**parts, VISCOUS: viscous} if viscous else parts


def _has_more(robot: Robot, joint: str) -> bool:
    """Whether effects act on a joint, or on the whole robot, that the regression does not know."""
    return any(here.owner in (joint, "robot") and here.effect.id not in (PLAIN, LIMIT) for here in robot.effects)


def _check_sign(joint: str, equation: DriveEquation) -> None:
    """A motor that turns against its command is a wiring or file mistake, not a parameter."""
    values = equation.solve()
    gain = values.get(GAIN)
    if gain is None or gain.value > -OPPOSITE * gain.sigma:
        return
    missing = equation.missing({law: value.value for law, value in values.items()})
    if missing < EXPLAINED * equation.torque(gain.value):
        raise RecordingError(
            f"{joint} moves against its command ({-gain.value / gain.sigma:.0f} sigma): the sign of the command or of "
            "the encoder is wrong; check the joint's axis in the URDF and the names and fields of the topics"
        )


def _mean(values: Sequence[Value]) -> float:
    """Weighted mean of what several joints say about one parameter."""
    weights = np.array([1.0 / max(value.sigma, 1e-9 * abs(value.value), 1e-99) ** 2 for value in values])
    return float(weights @ [value.value for value in values] / weights.sum())


def _with_values(calibration: Calibration, found: dict[str, float]) -> Calibration:
    values = calibration.values
    for i, name in enumerate(calibration.names):
        values[i] = found.get(name, values[i])
    dynamics = np.where(calibration.positive, np.log(np.where(calibration.positive, values, 1.0)), values)
    return calibration.with_points({DYNAMICS: dynamics})
