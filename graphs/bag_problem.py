# SPDX-License-Identifier: BSD-3-Clause
r"""One recording as factors on a chain of states.

X(0) --dyn-- X(1) --dyn-- X(2) -- ... -- X(N)          dyn:  dynamics of the robot's integrator
|    \\    /  |                            |            enc:  motor encoder, at a tick or between two
initial  enc,  gyro                          ...          gyro: full, vertical or relative
\\___ dynamics parameters, rotations, biases (shared by all ticks)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.bias_at_rest import BiasAtRestFactor
from jointscope.factors.distorted import DistortedFactor
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.euler_dynamics import EulerDynamics
from jointscope.factors.factor import Factor
from jointscope.factors.gyro import GyroFactor
from jointscope.factors.initial_state import InitialStateFactor
from jointscope.factors.interpolated import InterpolatedFactor
from jointscope.factors.midpoint_dynamics import MidpointDynamics
from jointscope.factors.motor_encoder import MotorEncoderFactor
from jointscope.factors.priors import BiasPrior
from jointscope.factors.relative_gyro import RelativeGyroFactor
from jointscope.factors.simpson_dynamics import SimpsonDynamics
from jointscope.factors.some_channels import SomeChannels
from jointscope.factors.step import Steps
from jointscope.factors.vertical_gyro import VerticalGyroFactor
from jointscope.graphs.timeline import Timeline
from jointscope.robots.command_path import CommandPath
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.elastic_joints import ElasticJoints
from jointscope.robots.lateness import Lateness, late_channels
from jointscope.robots.recording import Recording, Stream
from jointscope.robots.robot import ProcessNoise, Robot
from jointscope.robots.sensors import Gyro, MotorEncoder, Sensor

Array = NDArray[np.float64]

INTEGRATORS: dict[str, type[DynamicsFactor]] = {
    "euler": EulerDynamics,
    "midpoint": MidpointDynamics,
    "simpson": SimpsonDynamics,
}
ALIGNED = 1.0 / 3.0  # [sigma] a sample may be taken at a tick if the signal moves less than this in between
DEFLECTION_SIGMA = 0.087  # [rad] eq. (37) of the paper
REST_SIGMA = 6.9259e-5  # [rad/s] eq. (37): the robot starts at rest
MOVING_SIGMA = 20.0  # [rad/s] where it does not


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


@dataclass(frozen=True)
class BagProblem:
    """All factors of one recording.

    Attributes:
        robot: the model.
        recording: the data.
        timeline: ticks and commands.
        dynamics: one factor with all steps.
        placed: sensors, initial state, priors that belong to this bag.
        rests: whether the recording starts at rest.
    """

    robot: Robot
    recording: Recording
    timeline: Timeline
    dynamics: DynamicsFactor
    placed: tuple[Placed, ...]
    rests: bool

    @staticmethod
    def of(robot: Robot, recording: Recording) -> BagProblem:
        """Builds the factors of a recording."""
        timeline = Timeline.of(recording)
        weights = _impulse_weights(robot, recording, timeline)
        path = CommandPath(timeline.ticks, timeline.u, robot.effects, robot.joints)
        index = np.arange(len(timeline.h))
        steps = Steps(
            timeline.h, timeline.u, robot.noise, robot.layout, weights, path if path.changes else None, index
        )
        dynamics = INTEGRATORS[robot.choices.integrator](ElasticJoints(robot), steps, robot.joints)
        rests = starts_at_rest(robot, recording)
        spreads = tuple(memory.spread for memory in robot.memories.values())
        initial = InitialStateFactor(robot.layout, DEFLECTION_SIGMA, REST_SIGMA if rests else MOVING_SIGMA, spreads)
        placed = [Placed(initial, np.zeros(1, np.intp), timeline.ticks[:1])]
        for name in robot.sensors:
            placed += _place_sensor(robot, recording, timeline, name)
        for gyro in robot.gyros:
            placed.append(_without_states(BiasPrior(gyro), 1))
            if robot.choices.bias_at_rest and rests:
                resting = recording.streams[gyro.name].between(-np.inf, first_command_time(recording))
                if len(resting):
                    placed.append(_without_states(BiasAtRestFactor(gyro, resting.values), len(resting)))
        return BagProblem(robot, recording, timeline, dynamics, tuple(placed), rests)

    def with_noise(self, noise: ProcessNoise) -> BagProblem:
        """The same problem with another process noise."""
        return replace(self, dynamics=self.dynamics.with_noise(noise))

    @property
    def sensors(self) -> tuple[Placed, ...]:
        """The factors that hold measurements of states."""
        return tuple(p for p in self.placed if p.factor.name in self.robot.sensors)


def _impulse_weights(robot: Robot, recording: Recording, timeline: Timeline) -> Array:
    """M(q) of every step over the mean inertia of each coordinate, shape (m, n_link, n_link); q from the encoders."""
    encoder = recording.streams[robot.motor_encoder.name]
    middle = timeline.ticks[:-1] + 0.5 * timeline.h
    angles = [np.interp(middle, encoder.times, column) for column in encoder.values.T]
    layout, tree = robot.layout, robot.kinematic_tree
    q = np.zeros((len(middle), layout.n_link))
    q[:, layout.joint_link] = np.column_stack(angles) - robot.motor_encoder.zero
    M = tree.mass_matrix(q)
    M_at_zero = tree.mass_matrix(np.zeros((1, layout.n_link)))[0]
    alone = 1.0 / np.diag(np.linalg.inv(M_at_zero))
    return M / alone[:, None]


def first_command_time(recording: Recording) -> float:
    """Time of the first command that is not zero [s]; the last stamp if there is none."""
    command = recording.command
    moving = np.flatnonzero(np.any(command.values != 0.0, axis=1))
    return float(command.times[moving[0]] if len(moving) else command.times[-1])


def starts_at_rest(robot: Robot, recording: Recording, window: float = 0.1) -> bool:
    """Whether commands are zero, encoders and gyros still for the first `window` seconds."""
    encoder = recording.streams[robot.motor_encoder.name]
    t0 = float(max(encoder.times[0], recording.command.times[0]))
    if first_command_time(recording) < t0 + window:
        return False
    part = encoder.between(t0, t0 + window)
    if len(part) < 4:
        return False
    still = bool(np.all(_drift(part) < 4.0 * robot.motor_encoder.sigma))
    # friction may hold the motors while the links swing: the gyros must be still, too
    gyros = [(gyro, recording.streams[gyro.name].between(t0, t0 + window)) for gyro in robot.gyros]
    return still and all(
        len(part) < 6 or bool(np.all(_drift(part) < 5.0 * gyro.sigma * np.sqrt(6.0 / len(part))))
        for gyro, part in gyros
    )


def _drift(part: Stream) -> Array:
    """Change of the mean from the first to the last third, shape (c,)."""
    third = max(len(part) // 3, 1)
    return np.abs(part.values[-third:].mean(axis=0) - part.values[:third].mean(axis=0))


def _without_states(factor: Factor, m: int) -> Placed:
    return Placed(factor, np.zeros(0, np.intp), np.zeros(m))


def _place_sensor(robot: Robot, recording: Recording, timeline: Timeline, name: str) -> list[Placed]:
    """The samples of one sensor: those at a tick, those between two, and channels whose stamps are late apart."""
    placed = []
    for channels, late in late_channels(robot, name):
        if not late:
            placed += _place_on_time(robot, recording, timeline, name, channels)
            continue
        stream = recording.streams[name]
        lateness = Lateness.of(robot, late, stream.times)
        taken = stream.times - lateness.anchor
        inside = (taken >= timeline.ticks[0]) & (taken <= timeline.ticks[-1])
        step, fraction = timeline.locate(taken[inside])
        inner = _some(_sensor_factor(robot, recording, name, stream, inside), channels, robot.sensors[name])
        here = replace(lateness, stamps=lateness.stamps[inside], anchor=lateness.anchor[inside])
        factor = InterpolatedFactor(inner, fraction, timeline.h[step], robot.layout, here, _values(robot))
        placed.append(Placed(factor, step, stream.times[inside]))
    return placed


def _place_on_time(
    robot: Robot, recording: Recording, timeline: Timeline, name: str, channels: NDArray[np.intp]
) -> list[Placed]:
    """Channels with right stamps."""
    sensor = robot.sensors[name]
    stream = recording.streams[name].between(timeline.ticks[0], np.nextafter(timeline.ticks[-1], np.inf))
    step, fraction = timeline.locate(stream.times)
    h = timeline.h[step]
    nearest = step + (fraction > 0.5)
    distance = np.abs(stream.times - timeline.ticks[nearest])
    aligned = distance * _rate_of_change(stream) < ALIGNED * sensor.sigma
    placed = []
    if np.any(aligned):
        factor = _some(_sensor_factor(robot, recording, name, stream, aligned), channels, sensor)
        placed.append(Placed(factor, nearest[aligned], stream.times[aligned]))
    if not np.all(aligned):
        between = ~aligned
        inner = _some(_sensor_factor(robot, recording, name, stream, between), channels, sensor)
        factor = InterpolatedFactor(inner, fraction[between], h[between], robot.layout)
        placed.append(Placed(factor, step[between], stream.times[between]))
    return placed


def _some(factor: Factor, channels: NDArray[np.intp], sensor: Sensor) -> Factor:
    """The factor for some of a sensor's channels; the paper's forms of a gyro are never divided."""
    return factor if len(channels) == len(sensor.channels) else SomeChannels(factor, channels)


def _values(robot: Robot) -> dict[str, float]:
    """Present values of all parameters."""
    return {name: parameter.value for name, parameter in robot.parameters.items()}


def _rate_of_change(stream: Stream) -> Array:
    """How fast the fastest channel changes around each sample, shape (m,) [unit/s]."""
    if len(stream) < 3:
        return np.full(len(stream), np.inf)
    return np.abs(np.gradient(stream.values, stream.times, axis=0)).max(axis=1)


def _sensor_factor(robot: Robot, recording: Recording, name: str, stream: Stream, chosen: NDArray[np.bool_]) -> Factor:
    sensor, values, times = robot.sensors[name], stream.values[chosen], stream.times[chosen]
    if isinstance(sensor, MotorEncoder) or sensor.form == "full":
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

    Args:
        robot: the model.
        name: name of the sensor.
        values: measured, shape (m, c).
        times: stamps since the start of the recording, shape (m,) [s].
    """
    sensor = robot.sensors[name]
    inner: GyroFactor | MotorEncoderFactor
    if isinstance(sensor, MotorEncoder):
        inner = MotorEncoderFactor(sensor, values, robot.layout)
        seats = {joint: np.array([j]) for j, joint in enumerate(robot.joints)}
    else:
        inner = GyroFactor(sensor, values, robot.kinematic_tree, robot.layout)
        seats = {name: np.arange(len(sensor.channels))}
    effects = [here for here in robot.effects if isinstance(here.effect, ReadingEffect) and here.owner in seats]
    if not effects:
        return inner
    return DistortedFactor(inner, tuple((here, seats[here.owner]) for here in effects), times, _values(robot))


def _nearest(times: Array, wanted: Array) -> NDArray[np.intp]:
    """Index of the sample nearest to each wanted time."""
    right = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    return np.where(wanted - times[right - 1] < times[right] - wanted, right - 1, right)
