# SPDX-License-Identifier: BSD-3-Clause
"""What the sensors read at one state, with Jacobians: the equations of the sensor factors, fast enough for a loop.

    encoder  q_motor + zero + errors of effects, or q_link + zero; less its lag where it has play
    gyro     R_imu_body omega_body(q_link, v_link) + errors of effects, to which a bias is added
    accelerometer  R_imu_body f_body(q_link, v_link, a_link), to which a bias is added
    torque   scale times that of the springs, and offset
    current  g u / k_i - k_e v_motor + offset
    target   R_tracker_base (p_base(q_link) - place)

A test holds it against the factors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import LINK_SIDE
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.model.encoder_plays import EncoderPlays
from jointscope.robots.model.motor_currents import MotorCurrents
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Accelerometer, Gyro, LinkEncoder, MotorEncoder, Sensor

Array = NDArray[np.float64]
STEP = 1e-30  # [unit of the signal] of complex derivatives


class ReadingsAtOneState:
    """Predicted readings of all sensors of a robot.

    Args:
        robot: sensors, effects and their parameters.
        torques: reading and derivative of its torque sensor at a state of shape (d,), where it has one.
    """

    def __init__(self, robot: Robot, torques: Callable[[Array], tuple[Array, Array]] | None = None):
        self._torques = {} if robot.torque_sensor is None or torques is None else {robot.torque_sensor.name: torques}
        self._layout, tree = robot.layout, robot.kinematic_tree
        self._currents = _currents_of(robot)
        self._model, self._data = tree.model, tree.model.createData()
        self._zeros, self._coupling = np.zeros(tree.model.nv), tree.coupling
        self._gyros = {gyro.name: (tree.frame_id(gyro.body), gyro.R_imu_body) for gyro in robot.gyros}
        self._accelerometers = {sensor.name: _Seat.of(robot, sensor) for sensor in robot.accelerometers}
        self._moving = tree.model.createData()  # with accelerations
        values = robot.values
        self._targets = {t.name: (tree.frame_id(t.body), *t.seen(values)[:3]) for t in robot.targets}
        encoder = robot.motor_encoder
        self._encoder = np.zeros((robot.n, robot.layout.size))
        self._encoder[np.arange(robot.n), robot.layout.motor_q] = 1.0
        self._zero = np.asarray(encoder.zero, dtype=float)
        self._link_encoder = robot.link_encoder
        self._links = np.zeros((robot.n, robot.layout.size))
        self._links[np.arange(robot.n), robot.layout.joint_q] = 1.0
        plays = EncoderPlays.of(robot)
        for (sensor, channel), column in () if plays is None else zip(plays.seats, plays.lags, strict=True):
            (self._encoder if sensor == encoder.name else self._links)[channel, column] = -1.0
        self._errors = {name: _errors_of(robot, sensor, values) for name, sensor in robot.sensors.items()}
        self._at: Array | None = None

    def feels_acceleration(self, name: str) -> bool:
        """Whether a sensor's reading needs the accelerations of the links behind the state."""
        return name in self._accelerometers

    def feels_command(self, name: str) -> bool:
        """Whether a sensor's reading needs the acting command behind the state."""
        return name in self._currents

    def read(self, name: str, x: Array, time: float) -> tuple[Array, Array]:
        """Reading of a sensor without its bias, and its derivative by the state.

        Args:
            name: of the sensor.
            x: state, shape (d,); for an accelerometer with the link accelerations behind it, (d + n_link,), for
                currents with the acting command, (d + n,).
            time: stamp of the sample [s].

        Returns:
            Shapes (c,) and (c, d), or (c, d + n_link).
        """
        if name in self._accelerometers:
            return self._force(self._accelerometers[name], x)
        if name in self._targets:
            return self._place(*self._targets[name], x)
        if name in self._torques:
            return self._torques[name](x)
        if name in self._currents:
            J, by_u, at_rest = self._currents[name]
            return J @ x[: self._layout.size] + by_u * x[self._layout.size :] + at_rest, J
        if name in self._gyros:
            reading, J = self._rate(name, x)
            offset: Array | float = 0.0
        elif self._link_encoder is not None and name == self._link_encoder.name:
            reading, J, offset = self._links @ x, self._links, self._link_encoder.zero
        else:
            reading, J, offset = self._encoder @ x, self._encoder, self._zero
        for here, channels, p in self._errors[name]:
            reading, J = _disturbed(here, channels, p, reading, J, time)
        return reading + offset, J

    def _force(self, seat: _Seat, x: Array) -> tuple[Array, Array]:
        """As `specific_force` of many, by pinocchio's frame accelerations, which are faster for one state."""
        layout, coupling, local = self._layout, self._coupling, pin.ReferenceFrame.LOCAL
        q, v, a = x[layout.q_link], x[layout.v_link], x[layout.size :]
        if coupling is not None:
            q, v, a = coupling.positions(q), coupling.rates(v), coupling.rates(a)
        model, data, frame, p = self._model, self._moving, seat.frame, seat.lever
        pin.computeForwardKinematicsDerivatives(model, data, q, v, a)
        g = pin.updateFramePlacement(model, data, frame).rotation.T @ seat.gravity
        rate = pin.getFrameVelocity(model, data, frame, local)
        moved = pin.getFrameAcceleration(model, data, frame, local)
        rate_by_q, by_q, by_v, by_a = pin.getFrameAccelerationDerivatives(model, data, frame, local)
        W, P, V = pin.skew(rate.angular), pin.skew(p), pin.skew(rate.linear)
        f = moved.linear + W @ rate.linear + pin.skew(moved.angular) @ p + W @ W @ p - g
        by_rate = -V - W @ P - pin.skew(W @ p)  # of the terms with omega
        f_by_q = by_q[:3] - P @ by_q[3:] + by_rate @ rate_by_q[3:] + W @ rate_by_q[:3] - pin.skew(g) @ by_a[3:]
        f_by_v = by_v[:3] - P @ by_v[3:] + by_rate @ by_a[3:] + W @ by_a[:3]
        parts = [seat.R_imu_body @ part for part in (f_by_q, f_by_v, by_a[:3] - P @ by_a[3:])]
        if coupling is not None:
            parts = [part @ coupling.G for part in parts]
        J = np.zeros((3, len(x)))
        J[:, layout.q_link], J[:, layout.v_link], J[:, layout.size :] = parts
        return seat.R_imu_body @ f, J

    def _place(self, frame: int, p: Array, R: Array, origin: Array, x: Array) -> tuple[Array, Array]:
        """A point of a frame, seen from a tracker with rotation R in the base."""
        layout, coupling = self._layout, self._coupling
        q = x[layout.q_link] if coupling is None else coupling.positions(x[layout.q_link])
        model, data = self._model, self._moving
        pin.computeJointJacobians(model, data, q)
        here = pin.updateFramePlacement(model, data, frame)
        six = pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL)
        by_q = R.T @ here.rotation @ (six[:3] - pin.skew(p) @ six[3:])
        J = np.zeros((3, layout.size))
        J[:, layout.q_link] = by_q if coupling is None else by_q @ coupling.G
        return R.T @ (here.rotation @ p + here.translation - origin), J

    def _rate(self, name: str, x: Array) -> tuple[Array, Array]:
        layout, coupling = self._layout, self._coupling
        if self._at is not x:  # all gyros at one state share the kinematics
            q, v = x[layout.q_link], x[layout.v_link]
            if coupling is not None:
                q, v = coupling.positions(q), coupling.rates(v)
            pin.computeForwardKinematicsDerivatives(self._model, self._data, q, v, self._zeros)
            self._at = x
        frame, R = self._gyros[name]
        local = pin.ReferenceFrame.LOCAL
        by_q, by_v = pin.getFrameVelocityDerivatives(self._model, self._data, frame, local)
        omega_body = pin.getFrameVelocity(self._model, self._data, frame, local).angular
        J = np.zeros((3, layout.size))
        by_q, by_v = R @ by_q[3:], R @ by_v[3:]
        if coupling is not None:
            by_q, by_v = by_q @ coupling.G, by_v @ coupling.G
        J[:, layout.q_link], J[:, layout.v_link] = by_q, by_v
        return R @ omega_body, J


@dataclass(frozen=True)
class _Seat:
    """Where an accelerometer sits, how it is turned, and the gravity that it feels."""

    frame: int
    lever: Array
    R_imu_body: Array
    gravity: Array

    @staticmethod
    def of(robot: Robot, sensor: Accelerometer) -> _Seat:
        gyro = next(gyro for gyro in robot.gyros if gyro.name == sensor.gyro)
        place = sensor.place(robot.parameters), gyro.R_imu_body
        return _Seat(robot.kinematic_tree.frame_id(gyro.body), *place, robot.gravity_at(sensor))


def _currents_of(robot: Robot) -> dict[str, tuple[Array, Array, Array]]:
    """Of the sensor of currents its derivative by the state, (n, d), by the command of each motor, (n,), and offset."""
    sensor = robot.motor_current
    if sensor is None:
        return {}
    law, values, nothing = MotorCurrents(robot, sensor), robot.values, np.zeros((1, robot.n))
    by_u, by_v = law.slopes(values)
    J = np.zeros((robot.n, robot.layout.size))
    J[np.arange(robot.n), robot.layout.motor_v] = by_v
    return {sensor.name: (J, by_u, law.value(nothing, nothing, values)[0])}


def _errors_of(
    robot: Robot, sensor: Sensor, values: Mapping[str, float]
) -> list[tuple[ReadingEffect, NDArray[np.intp], dict[str, float]]]:
    """Effects on a sensor's reading, the channels that each acts on, and its parameters."""
    if isinstance(sensor, Gyro):
        seats = {sensor.name: np.arange(len(sensor.channels))}
    elif isinstance(sensor, MotorEncoder):
        seats = {joint: np.array([j]) for j, joint in enumerate(robot.joints)}
    elif isinstance(sensor, LinkEncoder):
        seats = {f"{joint}{LINK_SIDE}": np.array([j]) for j, joint in enumerate(robot.joints)}
    else:
        seats = {}
    return [
        (here.effect, seats[here.owner], here.own(values))
        for here in robot.effects
        if isinstance(here.effect, ReadingEffect) and here.owner in seats
    ]


def _disturbed(
    effect: ReadingEffect, channels: NDArray[np.intp], p: Mapping[str, float], reading: Array, J: Array, time: float
) -> tuple[Array, Array]:
    """Reading and derivative with one more effect; errors add up, each a function of the reading before it."""
    c = len(channels)
    moves = 1j * STEP * np.vstack([np.zeros((1, c)), np.eye(c)])
    found = np.asarray(effect.law(reading[channels] + moves, np.full(c + 1, time), p))
    changed, by_state = reading.copy(), J.copy()
    changed[channels] += found[0].real
    by_state[channels] += (found[1:].imag / STEP).T @ J[channels]
    return changed, by_state
