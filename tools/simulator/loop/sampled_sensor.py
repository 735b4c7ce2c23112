# SPDX-License-Identifier: BSD-3-Clause
"""The sensors of one run: when each sample is taken and arrives, and what it says of a trajectory.

The same samples can be had one by one while the engine runs (`OnlineSensors`) and all at once after it (`stream`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import LinkEncoder, MotorEncoder, Sensor, TorqueSensor
from jointscope.robots.recordings.recording import Stream
from jointscope.robots.units import joined
from jointscope.tools.simulator.loop.sensing import MountedAccelerometer, MountedGyro, Sampling, read_encoder
from jointscope.tools.simulator.world.engine import Engine
from jointscope.tools.simulator.world.hooks import age, distort, logged, taken_at
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.random_streams import random_stream
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]
Rows = NDArray[np.intp] | slice


class SampledSensor:
    """One sensor with the times of all its samples; a child says what they read.

    Args:
        sensor: as in the robot file.
        engine: the robot, and the effects that act on sensors.
        sampling: how samples are taken and sent.
        stamps: times of the samples by the clock of the sensor, shape (m,) [s].
        seed: of losses and delays.

    Attributes:
        sensor: as given.
        stamps: as given.
        taken: when the samples are really taken, shape (m,) [s].
        kept: which of them are not lost, shape (m,).
        received: when they arrive, by the clock that stamps them, shape (m,) [s].
    """

    def __init__(self, sensor: Sensor, engine: Engine, sampling: Sampling, stamps: Array, seed: int):
        self.sensor, self.stamps = sensor, stamps
        self.taken = taken_at(engine.effects, sensor, stamps)
        self.kept = sampling.kept(len(stamps), random_stream(seed, "drop", sensor.name))
        self.received = sampling.received(stamps, random_stream(seed, "transport", sensor.name))
        self._effects, self._age = engine.effects, age(engine.effects, sensor)

    def given_out(self, trajectory: Trajectory, rows: Rows) -> Array:
        """What the sensor gives out for some of its samples, which must lie inside the trajectory, shape (k, c)."""
        raise NotImplementedError

    def stream(self, trajectory: Trajectory) -> Stream:
        """What a bag holds of the samples that were taken before the end and not lost."""
        values = logged(self._effects, self.sensor, self.stamps, self.given_out(trajectory, slice(None)))
        kept = (self.taken <= trajectory.end) & self.kept
        sensor = self.sensor
        return Stream(
            sensor.name, self.stamps[kept], values[kept], sensor.channels, joined(sensor.units), self.received[kept]
        )


class SampledEncoder(SampledSensor):
    """The encoders on the motors, or on the links; `noise` is standard normal, shape (m, n_joints)."""

    def __init__(
        self,
        encoder: MotorEncoder | LinkEncoder,
        engine: Engine,
        sampling: Sampling,
        stamps: Array,
        seed: int,
        noise: Array,
    ):
        super().__init__(encoder, engine, sampling, stamps, seed)
        self._encoder, self._noise, self._quantized = encoder, noise, sampling.quantized
        self._columns = engine.motor if isinstance(encoder, MotorEncoder) else engine.link

    def given_out(self, trajectory: Trajectory, rows: Rows) -> Array:
        """Readings, shape (k, n_joints) [rad]."""
        angles = self._angles(trajectory, self.taken[rows])
        angles = distort(self._effects, self._encoder, self.stamps[rows], angles)
        return read_encoder(self._encoder, angles, self._noise[rows], self._quantized)

    def _angles(self, trajectory: Trajectory, times: Array) -> Array:
        """Each rotor or link as old as its channel, shape (k, n_joints) [rad]."""
        angles = np.empty((len(times), len(self._columns)))
        for old in np.unique(self._age):
            now = self._age == old
            angles[:, now] = trajectory.at(times - old)[0][:, self._columns[now]]
        return angles


class SampledGyro(SampledSensor):
    """One gyro as it is mounted."""

    def __init__(self, gyro: MountedGyro, engine: Engine, sampling: Sampling, stamps: Array, seed: int):
        super().__init__(gyro.sensor, engine, sampling, stamps, seed)
        self._gyro, self._engine = gyro, engine
        self._noise = random_stream(seed, "noise", gyro.sensor.name).standard_normal((len(stamps), 3))

    def given_out(self, trajectory: Trajectory, rows: Rows) -> Array:
        """Rates, shape (k, 3) [rad/s]."""
        gyro, sensor = self._gyro, self._gyro.sensor
        q, v = trajectory.at(self.taken[rows] - self._age[0])
        rates = self._engine.body_rates(sensor.name, q, v) @ gyro.R_imu_body.T
        rates = distort(self._effects, sensor, self.stamps[rows], rates)
        return rates + gyro.bias + sensor.sigma * self._noise[rows]


class SampledAccelerometer(SampledSensor):
    """One accelerometer as it is mounted."""

    def __init__(
        self, accelerometer: MountedAccelerometer, engine: Engine, sampling: Sampling, stamps: Array, seed: int
    ):
        super().__init__(accelerometer.sensor, engine, sampling, stamps, seed)
        self._mounted, self._engine, self._gravity = accelerometer, engine, accelerometer.gravity
        self._noise = random_stream(seed, "noise", accelerometer.sensor.name).standard_normal((len(stamps), 3))

    def given_out(self, trajectory: Trajectory, rows: Rows) -> Array:
        """Specific forces, shape (k, 3) [m/s^2]."""
        mounted, sensor = self._mounted, self._mounted.sensor
        times = self.taken[rows] - self._age[0]
        motion = *trajectory.at(times), trajectory.acceleration(times)
        forces = self._engine.specific_forces(sensor.name, self._gravity, *motion)
        forces = distort(self._effects, sensor, self.stamps[rows], forces @ mounted.R_imu_body.T)
        return forces + mounted.bias + sensor.sigma * self._noise[rows]


class SampledTorque(SampledSensor):
    """The torque sensors of the joints, by the engine's inverse dynamics of the links.

    Nothing but its spring acts on a link that has no effects of its own; scale and offset are those of `robot`.
    """

    def __init__(
        self, sensor: TorqueSensor, engine: Engine, sampling: Sampling, stamps: Array, seed: int, robot: Robot
    ):
        super().__init__(sensor, engine, sampling, stamps, seed)
        self._mujoco, self._model, self._link, self._sigmas = load_mujoco(), engine.model, engine.link, sensor.sigmas
        self._scale, self._offset = sensor.scale_and_offset(robot.values)
        self._noise = random_stream(seed, "noise", sensor.name).standard_normal((len(stamps), len(sensor.joints)))

    def given_out(self, trajectory: Trajectory, rows: Rows) -> Array:
        """Torques, shape (k, n_joints) [N m]."""
        times = self.taken[rows] - self._age[0]
        (q, v), a = trajectory.at(times), trajectory.acceleration(times)
        mujoco, data = self._mujoco, self._mujoco.MjData(self._model)
        torques, found = np.empty((len(q), len(self._link))), np.empty(self._model.nv)
        for k in range(len(q)):
            data.qpos[:], data.qvel[:], data.qacc[:] = q[k], v[k], a[k]
            mujoco.mj_fwdPosition(self._model, data)
            mujoco.mj_fwdVelocity(self._model, data)
            mujoco.mj_rne(self._model, data, 1, found)
            torques[k] = found[self._link]
        return self._scale * torques + self._offset + self._sigmas * self._noise[rows]


class SampledCurrent(SampledSensor):
    """The currents of the motors: the engine's actuators, wound to the data sheet of `robot`.

    The torque of an actuator at rest makes a current by its constant. A voltage behind a resistance R is left with
    u - n k_t v, so that the speed takes n k_t / R away.
    """

    def __init__(
        self, sensor: MotorCurrent, engine: Engine, sampling: Sampling, stamps: Array, seed: int, robot: Robot
    ):
        super().__init__(sensor, engine, sampling, stamps, seed)
        self._motor, self._sigmas, known = engine.motor, sensor.sigmas, robot.values
        self._delay = sensor.delay
        gain = engine.drive_gains
        n_kt = [known.get(sensor.torque_per_ampere(joint), g) for joint, g in zip(robot.joints, gain, strict=True)]
        self._n_kt, volts = np.array(n_kt), robot.command.unit in ("duty", "V")
        # n k_t / R of a winding that makes this torque of a unit of the command, itself of so many volts
        lost = gain / robot.command_volts if volts else np.zeros(robot.n)
        own = [known.get(sensor.back_emf(joint), float(k)) for joint, k in zip(robot.joints, lost, strict=True)]
        self._gain, self._lost = gain, np.array(own)
        self._offset = np.array([known.get(sensor.offset(joint), 0.0) for joint in robot.joints])
        self._noise = random_stream(seed, "noise", sensor.name).standard_normal((len(stamps), robot.n))

    def given_out(self, trajectory: Trajectory, rows: Rows) -> Array:
        """Currents, shape (k, n_joints) [A]."""
        times = self.taken[rows] - self._age[0] - self._delay
        v = trajectory.at(times)[1][:, self._motor]
        amperes = trajectory.command(times) * self._gain / self._n_kt - self._lost * v
        amperes = distort(self._effects, self.sensor, self.stamps[rows], amperes)
        return amperes + self._offset + self._sigmas * self._noise[rows]


class SampledTarget(SampledSensor):
    """A target as a tracker sees it that stands where the parameters of `robot` say."""

    def __init__(
        self, target: PositionTarget, engine: Engine, sampling: Sampling, stamps: Array, seed: int, robot: Robot
    ):
        super().__init__(target, engine, sampling, stamps, seed)
        self._engine, self._sigma = engine, target.sigma
        offset, place, turn = (
            [robot.parameters[name].value if name in robot.parameters else 0.0 for name in names]
            for names in (target.offset, target.place, target.turn)
        )
        model = robot.tree.model
        frame = model.frames[robot.tree.frame_id(target.body)]
        self._joint, self._p_joint = model.names[frame.parentJoint], frame.placement.act(target.at + offset)
        self._axes = Rotation.from_matrix(target.tracker_pose[:3, :3]) * Rotation.from_rotvec(turn)
        self._origin = target.tracker_pose[:3, 3] + place
        self._noise = random_stream(seed, "noise", target.name).standard_normal((len(stamps), 3))

    def given_out(self, trajectory: Trajectory, rows: Rows) -> Array:
        """Positions in the axes of the tracker, shape (k, 3) [m]."""
        q, _ = trajectory.at(self.taken[rows] - self._age[0])
        seen = self._axes.inv().apply(self._engine.points(self._joint, self._p_joint, q) - self._origin)
        return np.asarray(seen + self._sigma * self._noise[rows], dtype=np.float64)
