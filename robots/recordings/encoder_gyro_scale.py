# SPDX-License-Identifier: BSD-3-Clause
"""Do encoders and gyros agree about how far the joints turn? A wrong gear ratio or unit, or the scale of a gyro.

Far below their resonances elastic joints turn as their motors do, so the slow part of a gyro's rate is the sum of

    slope_j J_j(q) v_j  +  compliance_jk J_j(q) d2 v_k / dt2  +  small rotation of the mounting  +  bias

with slope 1 for every joint. The second term is the first that elasticity adds. A joint whose slope is off by more than
chance and more than what elastic robots leave gets a notice; where several gyros see it, they tell which side is wrong.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Gyro
from jointscope.robots.recordings.joint_motion import window_mean
from jointscope.robots.recordings.recording import Notice, Recording

Array = NDArray[np.float64]

STEP, SLOW = 0.01, 1.0  # [s] of the samples; of the window that leaves only what is slow
SHORTEST, LONGEST = 7.0, 120.0  # [s] of a recording that tells anything; of the part that is looked at
BLOCKS = 6  # of the recording, left out one by one: their spread is the uncertainty
ENOUGH_RATE = 0.02  # [rad/s] rms of the slow motion of a joint
OFF = 0.03  # smallest error of a slope worth a word
SURE = 4.0  # [sigma]
DECIDED = 4.0  # difference of chi-square from which other gyros say which side is wrong
LEFT_ALONE, LEFT = 0.005, 0.03  # error that elasticity leaves: where one joint alone moves the body, and else


@dataclass(frozen=True)
class Slope:
    """How far a joint turns by one gyro for each radian of its encoder, with standard deviation."""

    joint: str
    gyro: str
    value: float
    sigma: float

    def misses(self, value: float) -> float:
        """Distance from a value [sigma]."""
        return abs(self.value - value) / self.sigma


def check_scales(recording: Recording, robot: Robot, suspected: Collection[str] = ()) -> list[Notice]:
    """Notices about joints whose encoder and gyros disagree.

    Args:
        recording: the recording.
        robot: the robot.
        suspected: gyros that are known to be wrong otherwise; they are not asked.
    """
    asked = [gyro for gyro in robot.gyros if gyro.name not in suspected]
    slopes = [slope for gyro in asked for slope in slopes_of(recording, robot, gyro)]
    notices = []
    for joint in robot.joints:
        seen = sorted((s for s in slopes if s.joint == joint), key=lambda s: s.sigma)
        if seen and abs(seen[0].value - 1.0) > OFF and seen[0].misses(1.0) > SURE:
            notices.append(Notice(robot.motor_encoder.name, "unit", 0, _text(seen[0], seen[1:])))
    return notices


def slopes_of(recording: Recording, robot: Robot, gyro: Gyro) -> list[Slope]:
    """Slopes of all joints that a gyro sees moving; none where the recording is too short to tell."""
    encoder = recording.streams[robot.motor_encoder.name]
    streams = (encoder, recording.streams[gyro.name])
    start, end = max(s.times[0] for s in streams) + STEP, min(s.times[-1] for s in streams) - STEP
    if end - start < SHORTEST:
        return []
    times = np.arange(start, min(end, start + LONGEST), STEP)
    before, q, after = (
        np.column_stack([np.interp(times + shift, encoder.times, angle) for angle in encoder.values.T])
        for shift in (-STEP / 2, 0.0, STEP / 2)
    )
    v = joint_angles(robot, (after - before) / STEP)
    bend = np.gradient(np.gradient(v, times, axis=0), times, axis=0)
    J = gyro.R_imu_body @ robot.tree.body_rate(gyro.body, joint_angles(robot, q - robot.motor_encoder.zero), v)[2]
    measured = _slow(window_mean(streams[1], times, STEP))
    turns = [_slow(J[:, :, j] * v[:, [j]]) for j in range(robot.n)]
    seen = [j for j in range(robot.n) if np.sqrt(np.mean(np.sum(turns[j] ** 2, axis=1))) > ENOUGH_RATE]
    if not seen:
        return []
    axes = np.eye(3)
    columns = [turns[j] for j in seen]
    columns += [np.cross(axis, sum(turns)) for axis in axes] + [np.tile(axis, (len(measured), 1)) for axis in axes]
    columns += [_slow(J[:, :, j] * bend[:, [k]]) for j in seen for k in _on_the_branch(robot, gyro)]
    X = np.stack([c for c in columns if np.abs(c).max() > 1e-9], axis=2)
    values, spread = _jackknife(X, measured, len(seen))
    sigma = np.hypot(spread, LEFT_ALONE if len(seen) == 1 else LEFT)
    return [Slope(robot.joints[j], gyro.name, float(values[i]), float(sigma[i])) for i, j in enumerate(seen)]


def _on_the_branch(robot: Robot, gyro: Gyro) -> list[int]:
    """Joints that can load those before a gyro: all that stand on the first of them, where no joints follow others."""
    tree, below = robot.tree, robot.tree.joints_below(gyro.body)
    if tree.coupling is not None or not below:
        return list(range(robot.n))
    first = tree.model.getJointId(tree.joints[below[0]])
    return [
        k for k, joint in enumerate(tree.joints) if first in list(tree.model.supports[tree.model.getJointId(joint)])
    ]


def _jackknife(X: Array, y: Array, count: int) -> tuple[Array, Array]:
    """First values of a least-squares fit with their spread, each of shape (count,); X of shape (m, 3, k)."""

    def fit(kept: NDArray[np.bool_]) -> Array:
        A = X[kept].reshape(-1, X.shape[2])
        scale = np.linalg.norm(A, axis=0) + 1e-12
        return np.asarray(np.linalg.lstsq(A / scale, y[kept].ravel(), rcond=1e-6)[0] / scale)[:count]

    block = np.arange(len(y)) * BLOCKS // len(y)
    without = np.array([fit(block != i) for i in range(BLOCKS)])
    return fit(block >= 0), np.sqrt((BLOCKS - 1) * np.var(without, axis=0))


def _slow(signal: Array) -> Array:
    """A signal of shape (m, 3) without what is fast."""
    window = np.hanning(round(SLOW / STEP) + 2)[1:-1]
    window /= window.sum()
    return np.column_stack([np.convolve(column, window, "valid") for column in signal.T])


def _text(best: Slope, others: list[Slope]) -> str:
    text = f"{best.joint} turns {best.value:.3f} times as far by {best.gyro} as by its motor encoder"
    encoder, gyro = f"the gear ratio and the unit of the encoder of {best.joint}", f"the scale of {best.gyro}"
    if others:
        said = ", ".join(f"{s.value:.3f} by {s.gyro}" for s in others)
        for_encoder = sum(s.misses(1.0) ** 2 - s.misses(best.value) ** 2 for s in others)
        if abs(for_encoder) > DECIDED:
            return f"{text} ({said}): check {encoder if for_encoder > 0 else gyro}"
        text += f" ({said})"
    return f"{text}: check {encoder}, and {gyro}"
