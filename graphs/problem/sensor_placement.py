# SPDX-License-Identifier: BSD-3-Clause
"""Where the samples of a sensor sit on the chain of states: at a tick, or between two, whatever their stamps say.

Of a sample that lacks some channels the others are used.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.accelerated import AcceleratedFactor
from jointscope.factors.accelerometer import AccelerometerFactor
from jointscope.factors.distorted import DistortedFactor
from jointscope.factors.driven import DrivenFactor
from jointscope.factors.factor import Factor
from jointscope.factors.gyro import GyroFactor
from jointscope.factors.interpolated import InterpolatedFactor
from jointscope.factors.joint_torque import JointTorqueFactor
from jointscope.factors.link_encoder import LinkEncoderFactor
from jointscope.factors.motor_current import MotorCurrentFactor
from jointscope.factors.motor_encoder import MotorEncoderFactor
from jointscope.factors.position_target import PositionTargetFactor
from jointscope.factors.relative_gyro import RelativeGyroFactor
from jointscope.factors.rescaled import RescaledFactor
from jointscope.factors.some_channels import SomeChannels
from jointscope.factors.vertical_gyro import VerticalGyroFactor
from jointscope.graphs.problem.coarse_encoder import shared_error
from jointscope.graphs.problem.timeline import SAME, Timeline
from jointscope.robots.dynamics.command_path import CommandPath
from jointscope.robots.dynamics.spring_torques import SpringTorques
from jointscope.robots.effect_kinds.effect import LINK_SIDE
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.model.encoder_plays import EncoderPlays
from jointscope.robots.model.lateness import Lateness, late_channels, taken
from jointscope.robots.model.motor_currents import MotorCurrents
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import Accelerometer, Gyro, LinkEncoder, MotorEncoder, Sensor, TorqueSensor
from jointscope.robots.recordings.recording import Recording, Stream

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Channels = NDArray[np.intp]

ACCELERATION, COMMAND = "acceleration", "command"
ALIGNED = 1.0 / 3.0  # [sigma] a sample may be taken at a tick if the signal moves less than this in between


@dataclass(frozen=True)
class Placed:
    """A factor and where its samples sit.

    Attributes:
        factor: samples in the order of time.
        ticks: first state that each sample touches, shape (m,); empty for factors without states.
        times: time of each sample, shape (m,) [s].
    """

    factor: Factor
    ticks: NDArray[np.intp]
    times: Array


def place_sensor(robot: Robot, recording: Recording, timeline: Timeline, name: str, path: CommandPath) -> list[Placed]:
    """The samples of one sensor: those at a tick, those between two, and channels whose stamps are late apart.

    Args:
        robot: the model.
        recording: the data.
        timeline: ticks of the states.
        name: name of the sensor.
        path: how the commands act.
    """
    placed, behind = [], feels(robot.sensors[name])
    for channels, late in late_channels(robot, name):
        if not late and not behind:
            placed += _place_on_time(robot, recording, timeline, name, channels)
            continue
        stream = recording.streams[name]
        lateness = Lateness.of(robot, late, stream.times)
        times = taken(robot, name, late, stream.times)
        for rows, some in _as_measured(robot, recording, stream, name, channels):
            inside = rows & (times >= timeline.ticks[0]) & (times <= timeline.ticks[-1])
            if behind == COMMAND:  # of a command before the first nothing is known
                inside &= times > timeline.ticks[0] + SAME
            step, fraction = _located(timeline, times[inside], behind)
            inner = _some(_sensor_factor(robot, recording, name, stream, inside), some, robot.sensors[name])
            here = replace(lateness, stamps=lateness.stamps[inside], anchor=lateness.anchor[inside]) if late else None
            between = inner, fraction, timeline.h[step], robot.layout, here, robot.values
            if behind == COMMAND:
                factor: Factor = DrivenFactor(*between, path=path, step=step)
            else:
                factor = (AcceleratedFactor if behind else InterpolatedFactor)(*between)
            placed.append(Placed(factor, step, stream.times[inside]))
    return placed


def _located(timeline: Timeline, times: Array, behind: str) -> tuple[NDArray[np.intp], Array]:
    """Steps and fractions; a sample that is a rounding error behind a command has not seen it."""
    if behind != COMMAND:
        return (timeline.locate_ending if behind else timeline.locate)(times)
    step, _ = timeline.locate_ending(times - SAME)
    return step, (times - timeline.ticks[step]) / timeline.h[step]


def feels(sensor: Sensor) -> str:
    """What its reading needs behind the state: ACCELERATION, COMMAND, or nothing."""
    return ACCELERATION if isinstance(sensor, Accelerometer) else COMMAND if isinstance(sensor, MotorCurrent) else ""


def _as_measured(
    robot: Robot, recording: Recording, stream: Stream, name: str, channels: Channels
) -> list[tuple[Flags, Channels]]:
    """Samples that measured the same of some channels, shape (m,) each, and which these are.

    The paper's forms of a gyro need all its components, and those of the gyro that they are relative to.
    """
    every = np.ones(len(stream), bool)
    if stream.filled is None:
        return [(every, channels)]
    seen = ~stream.filled[:, channels]
    sensor = robot.sensors[name]
    if isinstance(sensor, Gyro) and sensor.form != "full":
        return [(np.asarray(seen.all(axis=1)), channels)]
    patterns, which = np.unique(seen, axis=0, return_inverse=True)
    parts = [(which.reshape(-1) == k, channels[pattern]) for k, pattern in enumerate(patterns) if pattern.any()]
    return sorted(parts, key=lambda part: -int(np.count_nonzero(part[0])))


def _place_on_time(
    robot: Robot, recording: Recording, timeline: Timeline, name: str, channels: Channels
) -> list[Placed]:
    """Channels with right stamps."""
    sensor = robot.sensors[name]
    stream = recording.streams[name].between(timeline.ticks[0], np.nextafter(timeline.ticks[-1], np.inf))
    parts = _as_measured(robot, recording, stream, name, channels)
    step, fraction = timeline.locate(stream.times)
    h = timeline.h[step]
    nearest = step + (fraction > 0.5)
    distance = np.abs(stream.times - timeline.ticks[nearest])
    aligned = np.all(distance[:, None] * _rate_of_change(stream) < ALIGNED * sensor.sigmas, axis=1)
    placed = []
    for rows, some in parts:
        at_tick, between = rows & aligned, rows & ~aligned
        if np.any(at_tick):
            factor = _some(_sensor_factor(robot, recording, name, stream, at_tick), some, sensor)
            placed.append(Placed(factor, nearest[at_tick], stream.times[at_tick]))
        if np.any(between):
            inner = _some(_sensor_factor(robot, recording, name, stream, between), some, sensor)
            factor = InterpolatedFactor(inner, fraction[between], h[between], robot.layout)
            placed.append(Placed(factor, step[between], stream.times[between]))
    return placed


def _some(factor: Factor, channels: Channels, sensor: Sensor) -> Factor:
    """The factor for some of a sensor's channels; the paper's forms of a gyro are never divided."""
    return factor if len(channels) == len(sensor.channels) else SomeChannels(factor, channels)


def _rate_of_change(stream: Stream) -> Array:
    """How fast each channel changes around each sample, shape (m, c) [unit/s]."""
    if len(stream) < 3:
        return np.full(stream.values.shape, np.inf)
    return np.abs(np.gradient(stream.values, stream.times, axis=0))


def _sensor_factor(robot: Robot, recording: Recording, name: str, stream: Stream, chosen: Flags) -> Factor:
    sensor, values, times = robot.sensors[name], stream.values[chosen], stream.times[chosen]
    if isinstance(sensor, MotorEncoder | LinkEncoder):
        factor, shared = factor_on_state(robot, name, values, times), shared_error(stream, sensor.sigmas)
        return factor if shared is None else RescaledFactor(factor, shared[chosen])
    if not isinstance(sensor, Gyro) or sensor.form == "full":
        return factor_on_state(robot, name, values, times)
    if sensor.form == "vertical":
        return VerticalGyroFactor(sensor, values, robot.tree, robot.layout)
    reference = robot.sensors[str(sensor.reference)]
    assert isinstance(reference, Gyro)
    other = recording.streams[reference.name]
    nearest = _nearest(other.times, times)
    return RelativeGyroFactor(sensor, values, robot.tree, robot.layout, reference, other.values[nearest])


def factor_on_state(robot: Robot, name: str, values: Array, times: Array) -> Factor:
    """A sensor with all its channels predicted from the state, whatever form its file chooses.

    An accelerometer is predicted from the state with the accelerations of the links behind it, a current from one with
    the acting command.

    Args:
        robot: the model.
        name: name of the sensor.
        values: measured, shape (m, c).
        times: stamps since the start of the recording, shape (m,) [s].
    """
    sensor = robot.sensors[name]
    inner: GyroFactor | LinkEncoderFactor | MotorEncoderFactor
    if isinstance(sensor, Accelerometer):
        body = next(gyro.body for gyro in robot.gyros if gyro.name == sensor.gyro)
        seat = robot.kinematic_tree, robot.layout, body, robot.gravity_at(sensor)
        return AccelerometerFactor(sensor, values, *seat, robot.values)
    if isinstance(sensor, PositionTarget):
        return PositionTargetFactor(sensor, values, robot.kinematic_tree, robot.layout, robot.values)
    if isinstance(sensor, TorqueSensor):
        return JointTorqueFactor(sensor, values, SpringTorques(robot))
    if isinstance(sensor, MotorCurrent):
        return MotorCurrentFactor(sensor, values, MotorCurrents(robot, sensor), robot.layout)
    if isinstance(sensor, MotorEncoder):
        inner = MotorEncoderFactor(sensor, values, robot.layout, _lags(robot, name))
        seats = {joint: np.array([j]) for j, joint in enumerate(robot.joints)}
    elif isinstance(sensor, LinkEncoder):
        inner = LinkEncoderFactor(sensor, values, robot.layout, _lags(robot, name))
        seats = {f"{joint}{LINK_SIDE}": np.array([j]) for j, joint in enumerate(robot.joints)}
    else:
        inner = GyroFactor(sensor, values, robot.kinematic_tree, robot.layout)
        seats = {name: np.arange(len(sensor.channels))}
    effects = [here for here in robot.effects if isinstance(here.effect, ReadingEffect) and here.owner in seats]
    if not effects:
        return inner
    return DistortedFactor(inner, tuple((here, seats[here.owner]) for here in effects), times, robot.values)


def _lags(robot: Robot, sensor: str) -> tuple[tuple[int, int], ...]:
    """Channel and column of the lag of each encoder of a sensor that has play."""
    plays = EncoderPlays.of(robot)
    if plays is None:
        return ()
    pairs = zip(plays.seats, plays.lags.tolist(), strict=True)
    return tuple((channel, column) for (name, channel), column in pairs if name == sensor)


def _nearest(times: Array, wanted: Array) -> NDArray[np.intp]:
    """Index of the sample nearest to each wanted time."""
    right = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    return np.where(wanted - times[right - 1] < times[right] - wanted, right - 1, right)
