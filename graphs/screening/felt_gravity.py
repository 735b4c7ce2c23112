# SPDX-License-Identifier: BSD-3-Clause
"""Accelerometers whose unit, sign, axes, gravity or link are others than the robot file says.

    reading = s P R_imu_body (a_origin - g + L lever + deviation of the bias)

with a unit's factor s and signed axes P. Positions of the encoders give a_origin, g and L; lever and bias are fitted,
and count as misfit as far as they are far from what the file says, since a free bias explains any gravity. Moments at
rest, or nearly so, count most: there springs and derivatives of positions say nothing wrong.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.screening.windowed_motion import faded_mean, windowed_motion
from jointscope.robots.bodies.body_accelerations import specific_force
from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import RIGHT_FROM_LEFT, Accelerometer, Gyro
from jointscope.robots.recordings.imu_plausibility import ALL_AXES, axes_matrix
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.robots.units import UNITS, si_factor, si_unit

Array = NDArray[np.float64]

FELT_GRAVITY = "gravity"  # kind of its notices
WINDOW, PERIODS = 0.06, 3.0  # [s], [periods] of the slower stream: a window is as long as the longer one
INSTANTS, FEWEST = 400, 20
NEARLY_AT_REST = 0.1  # of gravity: a motion of that size halves the weight of its moment
LEVER = 0.3  # [m] at which motion is judged, not knowing where on its link the sensor is
ODD = 0.35  # of gravity that a right file may leave; more is looked into
CLEARLY = 3.0  # times less that a mistake must leave to be named
AS_GOOD = 1.3  # times the least, and
SHARE = 0.03  # of gravity more: what leaves no more is as good, and the plainest of them is named
EARTH, ALIKE = 9.81, 0.07  # [m/s^2], share within which a size is its gravity: a bias of half a m/s^2
ALONG = 0.95  # cosine of the angle within which two vectors have one direction
FARTHEST = 1.0  # [m] of a lever that counts as 1 m/s^2 of misfit


@dataclass(frozen=True)
class Hypothesis:
    """What may be otherwise than the file says, the plainest first.

    Attributes:
        rank: plain ones are below others.
        unit: of the values in the bag; empty for that of the file.
        axes: P, shape (3, 3).
        gravity: in the base frame, shape (3,) [m/s^2].
        body: link that carries the sensor.
    """

    rank: int
    unit: str
    axes: Array
    gravity: Array
    body: str


def mistaken_accelerometers(recording: Recording, robot: Robot) -> list[Notice]:
    """What is plainly wrong with each accelerometer, with what to write; nothing where it is right, or motion hides it.

    Args:
        recording: what was measured.
        robot: as its file has it.

    Raises:
        RecordingError: values are in another unit than the robot file says.
    """
    robot = robot.in_posture(recording.posture)
    notices = []
    for sensor in robot.accelerometers:
        gyro = next(gyro for gyro in robot.gyros if gyro.name == sensor.gyro)
        size = float(np.linalg.norm(robot.gravity_at(sensor)))
        felt = Felt.of(recording, robot, sensor, gyro)
        if size == 0.0 or felt is None:
            continue
        found = felt.mistake(size)
        if found is None:
            continue
        text = _sentence(robot, sensor, gyro, found)
        if found.unit:
            raise RecordingError(text)
        notices.append(Notice(sensor.name, FELT_GRAVITY, 0, text))
    return notices


@dataclass(frozen=True)
class Felt:
    """Readings of one accelerometer at some instants, and motion of the joints there.

    Attributes:
        robot, sensor, gyro: whose.
        readings: less the bias of the file, in the axes of the body that the file says, shape (m, 3) [m/s^2].
        q, v, a: of the joints, shape (m, n).
    """

    robot: Robot
    sensor: Accelerometer
    gyro: Gyro
    readings: Array
    q: Array
    v: Array
    a: Array

    @staticmethod
    def of(recording: Recording, robot: Robot, sensor: Accelerometer, gyro: Gyro) -> Felt | None:
        """Where both streams last; None where that is too short."""
        encoder = robot.link_encoder or robot.motor_encoder
        if encoder is robot.motor_encoder and not robot.motor_encoder.zero_known:
            return None
        angles, stream = recording.streams[encoder.name], recording.streams[sensor.name]
        window = max(WINDOW, PERIODS * max(float(np.max(s.periods)) for s in (angles, stream)))
        begin, end = max(angles.times[0], stream.times[0]), min(angles.times[-1], stream.times[-1])
        if not np.isfinite(window) or end - begin < FEWEST * window / PERIODS:
            return None
        times = np.linspace(begin + 1.5 * window, end - 1.5 * window, INSTANTS)
        found = windowed_motion(angles, times, window)
        motion = [found.q - encoder.zero, found.v, found.a]
        if encoder is robot.motor_encoder:
            motion = [joint_angles(robot, x) for x in motion]
        readings = (faded_mean(stream, times, window) - sensor.bias) @ gyro.R_imu_body
        return Felt(robot, sensor, gyro, readings, *motion)

    def mistake(self, size: float) -> Hypothesis | None:
        """The plainest mistake that explains the readings clearly better than the file does.

        Args:
            size: of gravity [m/s^2].
        """
        as_it_is = Hypothesis(0, "", np.eye(3), self.robot.gravity_at(self.sensor), self.gyro.body)
        now = self.left([as_it_is])[0]
        if now < ODD * size:
            return None
        tried = list(self._tried(as_it_is))
        left = self.left(tried)
        least = min(left)
        if least > now / CLEARLY:
            return None
        good = [k for k, x in enumerate(left) if x < AS_GOOD * least + SHARE * EARTH]
        return tried[min(good, key=lambda k: (tried[k].rank, -np.trace(tried[k].axes), k))]

    def left(self, hypotheses: list[Hypothesis]) -> list[float]:
        """What each leaves of the readings, root mean square [m/s^2]."""
        found, fits = [], {}
        for one in hypotheses:
            if one.body not in fits:
                fits[one.body] = self._fit(one.body)
            axes, weights, moved, A, projector = fits[one.body]
            R = self.gyro.R_imu_body
            factor = 1.0 if not one.unit else si_factor(one.unit) / si_factor(self.sensor.source.unit)
            seen = factor * self.readings @ (R.T @ one.axes @ R)  # in the axes of the body
            y = (weights[:, None] * (seen - moved - axes @ one.gravity)).ravel()
            y = np.concatenate([y, np.zeros(6)])
            found.append(float(np.linalg.norm(y - A @ (projector @ y))))
        return found

    def _fit(self, body: str) -> tuple[Array, Array, Array, Array, Array]:
        """For one link: gravity's part, weights, motion's part, and the equations of lever and bias."""
        tree, none = self.robot.kinematic_tree, np.zeros(3)
        lever = self.sensor.place(self.robot.parameters)
        still = np.zeros_like(self.q)
        axes = np.stack([specific_force(tree, body, none, self.q, still, still, e).value for e in np.eye(3)], axis=2)
        motion = specific_force(tree, body, lever, self.q, self.v, self.a, none)
        size = float(np.linalg.norm(self.robot.gravity_at(self.sensor)))
        moved = np.sum(motion.value**2, axis=1) + LEVER**2 * np.sum(motion.by_lever**2, axis=(1, 2))
        weights = 1.0 / (1.0 + moved / (NEARLY_AT_REST * size) ** 2)
        weights = np.sqrt(weights / np.sum(weights))
        blocks = np.concatenate([motion.by_lever, np.broadcast_to(np.eye(3), (len(weights), 3, 3))], axis=2)
        A = (weights[:, None, None] * blocks).reshape(-1, 6)
        A = np.vstack([A, np.diag([1.0 / FARTHEST] * 3 + [1.0] * 3)])
        return axes, weights, motion.value, A, np.linalg.pinv(A)

    def _gravity(self, body: str) -> Array:
        """Gravity in the base frame that explains the readings best, shape (3,) [m/s^2]."""
        axes, weights, moved, A, projector = self._fit(body)
        directions = np.vstack([(weights[:, None, None] * axes).reshape(-1, 3), np.zeros((6, 3))])
        y = np.concatenate([(weights[:, None] * (self.readings - moved)).ravel(), np.zeros(6)])
        left = directions - A @ (projector @ directions)
        return np.asarray(np.linalg.lstsq(left, y, rcond=None)[0])

    def _tried(self, now: Hypothesis) -> Iterator[Hypothesis]:
        """All that may be otherwise, one at a time."""
        source, size = self.sensor.source, float(np.linalg.norm(now.gravity))
        for unit in UNITS:
            if si_unit(unit) == si_unit(source.unit) and unit != source.unit:
                yield replace(now, rank=1, unit=unit)
        yield replace(now, rank=2, gravity=-now.gravity)
        if abs(size - EARTH) > ALIKE * EARTH:
            yield replace(now, rank=2, gravity=now.gravity * EARTH / size)
        yield replace(now, rank=3, axes=-np.eye(3))
        for axis, sign in itertools.product(np.eye(3), (1.0, -1.0)):
            yield replace(now, rank=4, gravity=sign * size * axis)
        for body in self.robot.tree.bodies:
            if body != now.body:
                yield replace(now, rank=5, body=body)
        for axes in map(axes_matrix, ALL_AXES):
            yield replace(now, rank=6 if np.linalg.det(axes) > 0.0 else 7, axes=axes)
        felt = self._gravity(now.body)
        if abs(float(np.linalg.norm(felt)) - EARTH) < ALIKE * EARTH:
            yield replace(now, rank=8, gravity=felt.round(2))


def _sentence(robot: Robot, sensor: Accelerometer, gyro: Gyro, found: Hypothesis) -> str:
    """What was seen, and what to write."""
    name, file, now = sensor.name, robot_argument(robot), sensor.source.unit
    if found.unit:
        return (
            f"{name} does not feel gravity of its size: its values look like {found.unit}: set `unit` of "
            f"sensors.{name} in the robot file (now {now}) to {found.unit}"
        )
    if found.body != gyro.body:
        return (
            f"{name} feels gravity as on {found.body}, not as on {gyro.body}; if that is so, write "
            f"`body: {found.body}` in sensors.{gyro.name} of {file}"
        )
    if not np.array_equal(found.gravity, robot.gravity_at(sensor)):
        vector = ", ".join(f"{x:.12g}" for x in found.gravity + 0.0)
        place = file if sensor.gravity is None else f"sensors.{name} of {file}"
        along = float(found.gravity @ robot.gravity_at(sensor))
        turned = abs(along) < ALONG * float(np.linalg.norm(found.gravity) * np.linalg.norm(robot.gravity_at(sensor)))
        kind = "along another axis" if turned else "the other way" if along < 0.0 else "of another size"
        text = f"{name} feels gravity {kind} than the robot file says: if that is so, write `gravity: [{vector}]` in"
        return f"{text} {place}" + f"; or {name} reads minus what accelerometers do" * (kind == "the other way")
    return _axes_sentence(sensor, gyro, found.axes, file)


def _axes_sentence(sensor: Accelerometer, gyro: Gyro, axes: Array, file: str) -> str:
    name = sensor.name
    if np.array_equal(axes, -np.eye(3)):
        return (
            f"{name} reads minus what accelerometers do, gravity and motion alike: turn the sign of all its axes where "
            f"it is published, or leave sensors.{name} out of {file}"
        )
    right = axes @ gyro.R_imu_body
    hand = ""
    if np.linalg.det(axes) < 0.0:
        value = "false" if sensor.source.scale else "true"
        right, hand = np.diag(RIGHT_FROM_LEFT) @ right, f"`left_handed: {value}` there and in sensors.{name}, and "
    rows = ", ".join("[" + ", ".join(f"{x:.4g}" for x in row + 0.0) + "]" for row in right.round(6))
    return (
        f"{name} feels gravity along other axes: R_imu_body of sensors.{gyro.name} is nearest to [{rows}]; if that is "
        f"so of its gyroscope, too, write {hand}that as its value in {file}; else order the axes of {name} as those of "
        "its gyroscope are where it is published"
    )
