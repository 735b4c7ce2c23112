# SPDX-License-Identifier: BSD-3-Clause
r"""One recording as factors on a chain of states.

X(0) --dyn-- X(1) --dyn-- X(2) -- ... -- X(N)          dyn:  dynamics of the robot's integrator
|    \\    /  |                            |            enc:  motor encoder, at a tick or between two
initial  enc,  gyro                          ...          gyro: full, vertical or relative
\\___ dynamics parameters, rotations, biases (shared by all ticks)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.bias_at_rest import BiasAtRestFactor
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.euler_dynamics import EulerDynamics
from jointscope.factors.factor import Factor
from jointscope.factors.initial_state import InitialStateFactor
from jointscope.factors.interpolated import interpolate
from jointscope.factors.midpoint_dynamics import MidpointDynamics
from jointscope.factors.priors import BiasPrior
from jointscope.factors.simpson_dynamics import SimpsonDynamics
from jointscope.factors.step import Steps
from jointscope.graphs.problem.dead_zone_edges import DeadZoneEdges
from jointscope.graphs.problem.sensor_placement import Placed, place_sensor
from jointscope.graphs.problem.standstill import Stretches, holding_motors, stiffness
from jointscope.graphs.problem.timeline import Timeline
from jointscope.robots.dynamics.command_path import CommandPath
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.model.lasting_torques import equation_inertias, memory_spreads
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.process_noise import ProcessNoise
from jointscope.robots.recordings.recording import Recording, Stream

Array = NDArray[np.float64]

INTEGRATORS: dict[str, type[DynamicsFactor]] = {
    "euler": EulerDynamics,
    "midpoint": MidpointDynamics,
    "simpson": SimpsonDynamics,
}
DEFLECTION_SIGMA = 0.087  # [rad] eq. (37) of the paper
REST = 0.1  # [s] stillness from which a robot is taken to start at rest
REST_SIGMA = 6.9259e-5  # [rad/s] eq. (37): the robot starts at rest
MOVING_SIGMA = 20.0  # [rad/s] where it does not
FREE = 20.0  # [rad/s / sqrt(s)] density of velocities where something unknown acts; the sensors alone tell states there
BAND = 3.0  # the same of a motor that stands, whose friction brakes it
BANDS = 10.0  # times the dry friction that the robot file says, by which the torque that holds a joint may be off


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
        owner: number of the recording that this is a piece of; pieces share its biases. None for a whole recording.
        between: times at which steps were divided [s]; None where none was.
    """

    robot: Robot
    recording: Recording
    timeline: Timeline
    dynamics: DynamicsFactor
    placed: tuple[Placed, ...]
    rests: bool
    owner: int | None = None
    between: Array | None = None

    @staticmethod
    def of(robot: Robot, recording: Recording, between: Array | None = None) -> BagProblem:
        """Builds the factors of a recording; its robot is in the posture of the recording.

        Args:
            robot: the model.
            recording: the data.
            between: times at which steps are divided that would be too long [s].
        """
        robot.need_link_dynamics()
        robot = robot.in_posture(recording.posture)
        timeline = Timeline.of(recording, robot.command_held, between)
        weights = _impulse_weights(robot, recording, timeline)
        path = CommandPath(timeline.ticks, timeline.u, robot.effects, robot.joints, not robot.command_held)
        index = np.arange(len(timeline.h))
        acting = path if path.changes or path.runs_on else None
        # steps that were divided elsewhere leave those as they are at which a motor stands
        whole = timeline.h if between is None else Timeline.of(recording, robot.command_held).h
        holds = holding_motors(robot, recording, whole)
        free, slides = _free(robot, recording, timeline, holds), _sliding(robot, timeline, holds, whole)
        steps = Steps(timeline.h, timeline.u, robot.noise, robot.layout, weights, acting, index, free, slides)
        dynamics = INTEGRATORS[robot.choices.integrator](ElasticJoints(robot), steps, robot.joints)
        rests = starts_at_rest(robot, recording)
        spreads = tuple(memory_spreads(robot).tolist())
        # what only weighs takes the file's matrix: it must not move with its elements while they are estimated
        seen = None if robot.transmission is None else np.asarray(np.linalg.inv(robot.transmission), dtype=np.float64)
        initial = InitialStateFactor(
            robot.layout, DEFLECTION_SIGMA, REST_SIGMA if rests else MOVING_SIGMA, spreads, seen
        )
        placed = [Placed(initial, np.zeros(1, np.intp), timeline.ticks[:1])]
        for name in robot.sensors:
            placed += place_sensor(robot, recording, timeline, name, path)
        placed += [_without_states(BiasPrior(sensor), 1) for sensor in robot.accelerometers]
        for gyro in robot.gyros:
            placed.append(_without_states(BiasPrior(gyro), 1))
            if robot.choices.bias_at_rest and rests:
                resting = recording.streams[gyro.name].whole.between(-np.inf, first_command_time(recording))
                values = resting.values[recording.are_judged(resting.times)]
                if len(values):
                    placed.append(_without_states(BiasAtRestFactor(gyro, values), len(values)))
        return BagProblem(robot, recording, timeline, dynamics, tuple(placed), rests, between=between)

    def with_noise(self, noise: ProcessNoise) -> BagProblem:
        """The same problem with another process noise."""
        placed = self.placed
        if noise.n_lasting:
            placed = (replace(placed[0], factor=self.initial.with_lasting(noise.lasting)), *placed[1:])
        return replace(self, dynamics=self.dynamics.with_noise(noise), placed=placed)

    def of_robot(self, robot: Robot) -> BagProblem:
        """The same recording, the same piece, of a robot with other choices, constants or sensors."""
        return replace(BagProblem.of(robot, self.recording, self.between), owner=self.owner)

    def divided(self, x: Array, values: Mapping[str, float]) -> tuple[BagProblem, Array]:
        """The same with its steps divided where springs meet edges of dead zones, and its states; as it is if none do.

        Args:
            x: states at its ticks, shape (m + 1, d).
            values: parameters by full name, those that are not free may be missing.
        """
        edges, ticks = DeadZoneEdges.of(self.robot.with_values(values)), self.timeline.ticks
        known = np.zeros(0) if self.between is None else self.between
        between = known if edges is None else np.union1d(known, edges.times(ticks, x, known))
        if len(between) == len(known):
            return self, x
        return self.divided_at(between, x)

    def divided_at(self, between: Array, x: Array) -> tuple[BagProblem, Array]:
        """The same with its steps divided at some times, and its states there, too.

        Args:
            between: all times that divide steps [s].
            x: states at its ticks, shape (m + 1, d).
        """
        divided = replace(BagProblem.of(self.robot, self.recording, between), owner=self.owner)
        step, fraction = self.timeline.locate(divided.timeline.ticks)
        states = interpolate(self.robot.layout, x[step], x[step + 1], fraction, self.timeline.h[step])
        return divided.with_noise(self.dynamics.steps.noise), states

    def of_recording(self, recording: Recording) -> BagProblem:
        """The same piece of the same recording, of which something else is left out."""
        same = BagProblem.of(self.robot, recording, self.between)
        return replace(same, owner=self.owner).with_noise(self.dynamics.steps.noise)

    def motor_stands(self, ticks: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether a motor stands whose friction is stiff (see `holding_motors`), at each of these ticks, shape (s,)."""
        slides = self.dynamics.steps.at_ticks
        if slides is None:
            return np.zeros(len(ticks), bool)
        return np.asarray(np.any(slides[ticks] < 1.0, axis=1))

    @property
    def as_predicted(self) -> BagProblem:
        """The same problem with the noise that predictions have: about a motor that sticks nothing is open."""
        if self.dynamics.steps.sliding is None:
            return self
        steps = replace(self.dynamics.steps, free=_free(self.robot, self.recording, self.timeline, {}))
        return replace(self, dynamics=replace(self.dynamics, steps=steps))

    @property
    def initial(self) -> InitialStateFactor:
        """The prior of the first state."""
        first = self.placed[0].factor
        assert isinstance(first, InitialStateFactor)
        return first

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
    q_motor = np.column_stack(angles) - robot.motor_encoder.zero
    q[:, layout.joint_link] = q_motor if robot.transmission is None else q_motor @ robot.transmission.T
    M = tree.weighing_inertia(q)
    _add_rotors(M, robot, recording, timeline)
    return M / tree.free_inertias()[:, None]


def _add_rotors(M: Array, robot: Robot, recording: Recording, timeline: Timeline) -> None:
    """Where a rigid joint sticks its torque must be in no row but its own: what it moves is its rotor, too.

    Rows keep their size, so that the noise of the others means the same.
    """
    layout, rotors = robot.layout, np.zeros(M.shape[1])
    sticks = np.zeros(len(M), bool)
    for link, joint in zip(layout.joint_link, robot.joints, strict=True):
        if joint not in layout.motors:
            rotors[link] = robot.drive_parameter(joint, "inertia").value
            sticks |= recording.sticks(joint, timeline.ticks[1:], timeline.h)
    alone = np.diagonal(M[sticks], axis1=1, axis2=2)
    M[sticks] = (M[sticks] + np.diag(rotors)) * (alone / (alone + rotors))[:, :, None]


def _free(robot: Robot, recording: Recording, timeline: Timeline, holds: Mapping[str, Stretches]) -> Array | None:
    """Where steps bind no motion: all in a stretch that is left out, one joint where it sticks; None for neither."""
    recording = replace(recording, sticking={**recording.sticking, **holds})
    if not recording.left_out and not recording.sticking:
        return None
    end, h, layout = timeline.ticks[1:], timeline.h, robot.layout
    free = np.repeat(FREE * ~recording.are_judged(end, h)[:, None], len(layout.velocities), axis=1)
    inertias = equation_inertias(robot)
    for row, joint in zip(layout.motor_row, robot.joints, strict=True):
        if joint in recording.sticking:
            held = (
                (BAND if joint in holds else BANDS)
                * robot.drive_parameter(joint, "coulomb_torque").value
                / inertias[row]
                * np.sqrt(h)
            )
            free[:, row] = np.maximum(free[:, row], np.where(recording.sticks(joint, end, h), held, 0.0))
    return free


def _sliding(robot: Robot, timeline: Timeline, holds: Mapping[str, Stretches], whole: Array) -> Array | None:
    """How sharply friction turns over at both ends of each step, shape (m, 2, n), see `Steps`; None for its own law.

    Where a motor stands, as sharply as may be integrated over steps that are not divided, whose lengths are `whole`: it
    is braked, its friction is what it may be.
    """
    if not holds:
        return None
    ticks, h = np.ones((len(timeline.ticks), robot.n)), float(np.median(whole))
    for joint, stretches in holds.items():
        gentle = 1.0 / stiffness(robot, joint, h)
        for t0, t1 in stretches:
            ticks[(timeline.ticks >= t0) & (timeline.ticks <= t1), robot.joints.index(joint)] = gentle
    return np.stack([ticks[:-1], ticks[1:]], axis=1)


def first_command_time(recording: Recording) -> float:
    """Time of the first command that is not zero [s]; the last stamp if there is none."""
    command = recording.command
    moving = np.flatnonzero(np.any(command.values != 0.0, axis=1))
    return float(command.times[moving[0]] if len(moving) else command.times[-1])


def starts_at_rest(robot: Robot, recording: Recording) -> bool:
    """Whether commands are zero, encoders and gyros still for the first REST seconds."""
    encoder = recording.streams[robot.motor_encoder.name]
    t0 = float(max(encoder.times[0], recording.command.times[0]))
    if first_command_time(recording) < t0 + REST:
        return False
    part = encoder.between(t0, t0 + REST)
    if len(part) < 4:
        return False
    still = bool(np.all(_drift(part) < 4.0 * robot.motor_encoder.sigmas))
    # friction may hold the motors while the links swing: the gyros must be still, too
    gyros = [(gyro, recording.streams[gyro.name].between(t0, t0 + REST)) for gyro in robot.gyros]
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
