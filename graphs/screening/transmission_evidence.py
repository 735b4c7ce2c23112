# SPDX-License-Identifier: BSD-3-Clause
"""How well a transmission matrix T explains what sensors on links see, or what drives do.

    encoders on links    q_link = T (theta + delta) + const
    gyros on links       omega  = J(q_link) T (theta' + delta') + const
    drives               k u    = I theta'' + d theta' + mu sign(theta') + tau_p + const
    springs              delta  = c tau_p,   tau_p = T^T tau_link(T theta, T theta', T theta'')

theta are angles of motors. c, k, I, d and mu are fitted, none below zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from jointscope.graphs.screening.windowed_motion import WindowedMotion, faded_mean, windowed_motion
from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Gyro
from jointscope.robots.recordings.imu_plausibility import ALL_AXES, axes_matrix
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]
Equations = list[tuple[Array, Array, Array]]  # what was measured, what the matrix says of it, what is fitted

PERIODS = 3.0  # of the slowest stream, which a window is at least long
INSTANTS, FEWEST_WINDOWS = 800, 8
ODD = 0.2  # of what was measured that a right matrix may leave; more is looked into
REVERSAL = 0.02  # [rad/s] within which dry friction turns over
MOST_CHANGES = 1000  # of what is zero in a fit


def stated_matrix(robot: Robot) -> Array:
    """T of the file with its parameters and effects, shape (n, n)."""
    return joint_angles(robot, np.eye(robot.n)).T


class Bar(NamedTuple):
    """What a matrix must do better than the file's to be named.

    Attributes:
        fits: share of what was measured that it may leave.
        clearly: times less than the file's that it must leave.
        in_halves: the same in each half of the recording.
        alike: times the least: where another matrix leaves no more, nothing is named.
    """

    fits: float
    clearly: float
    in_halves: float
    alike: float


STANDS = 1e-9  # of the largest reading, from which a column moves
LINKS, DRIVES = Bar(0.5, 1.4, 1.2, 1.15), Bar(0.35, 1.7, 1.3, 1.3)  # drives see a soft spring's link hardly at all


@dataclass(frozen=True)
class Moved:
    """Motion of the motors at some instants, and a quarter of a window before and after them."""

    recording: Recording
    robot: Robot
    times: Array
    window: float
    now: WindowedMotion
    before: WindowedMotion
    after: WindowedMotion

    @staticmethod
    def of(recording: Recording, robot: Robot, window: float) -> Moved | None:
        """Where all streams last; None where that is too short."""
        streams = list(recording.streams.values())
        encoder = recording.streams[robot.motor_encoder.name]
        window = max(window, PERIODS * max(float(np.max(s.periods)) for s in streams))
        begin, end = max(s.times[0] for s in streams) + 2.0 * window, min(s.times[-1] for s in streams) - 2.0 * window
        if not np.isfinite(window) or end - begin < FEWEST_WINDOWS * window:
            return None
        times = np.linspace(begin, end, INSTANTS)
        moved = [windowed_motion(encoder, times + part * window, window) for part in (0.0, -0.25, 0.25)]
        zeroed = [motion._replace(q=motion.q - robot.motor_encoder.zero) for motion in moved]
        return Moved(recording, robot, times, window, *zeroed)

    def load(self, T: Array, motion: WindowedMotion | None = None) -> Array:
        """tau_p, the torques that the motors feel of rigid links, shape (m, n) [N m]."""
        motion = motion or self.now
        return self.robot.tree.torque(*(x @ T.T for x in motion)) @ T

    def measured(self, name: str) -> Array:
        """Means of a stream around the instants, shape (m, k)."""
        return faded_mean(self.recording.streams[name], self.times, self.window)


@dataclass(frozen=True)
class Told:
    """What some sensors say of a matrix."""

    sensors: str
    now: Array
    equations: Callable[[Array], Equations]
    otherwise: Callable[[], float] = lambda: np.inf
    bar: Bar = LINKS

    def left(self, T: Array) -> tuple[float, float, float]:
        """Share of what was measured that is left: of everything, and of both halves."""
        size, left = np.zeros(2), np.zeros(2)
        for measured, said, fitted in self.equations(T):
            y, z, A = measured - measured.mean(axis=0), measured - said, fitted - fitted.mean(axis=0)
            z = z - z.mean(axis=0)
            rows = A.reshape(-1, A.shape[-1])
            scale = np.linalg.norm(rows, axis=0) + 1e-300
            found = nnls(rows / scale, z.ravel(), maxiter=MOST_CHANGES)[0] / scale
            z = z - A @ found
            for half in range(2):
                part = np.array_split(np.arange(len(y)), 2)[half]
                size[half] += np.sum(y[part] ** 2)
                left[half] += np.sum(z[part] ** 2)
        shares = np.sqrt([left.sum() / max(size.sum(), 1e-300), *(left / np.maximum(size, 1e-300))])
        return float(shares[0]), float(shares[1]), float(shares[2])

    def best(self, tried: Sequence[Array], beside: Told) -> tuple[int, float, float] | None:
        """The only matrix that leaves clearly less than the file's.

        Args:
            tried: matrices.
            beside: what tells between those that leave as little.

        Returns:
            Its place, and the shares that the file's and this one leave; None where there is no such matrix.
        """
        bar, now = self.bar, self.left(self.now)
        if now[0] < ODD:
            return None
        left = [self.left(matrix) for matrix in tried]
        least = min((shares[0] for shares in left), default=np.inf)
        if least > min(bar.fits, now[0] / bar.clearly) or self.otherwise() < bar.alike * least:
            return None
        good = [k for k, shares in enumerate(left) if shares[0] < bar.alike * least]
        by_others = {k: beside.left(tried[k])[0] for k in good}
        good = [k for k in good if by_others[k] < bar.alike * min(by_others.values())]
        shares = left[good[0]]
        halves = all(share < before / bar.in_halves for before, share in zip(now[1:], shares[1:], strict=True))
        return (good[0], now[0], shares[0]) if halves and len(good) == 1 else None


def seen_by_link_encoder(moved: Moved) -> Told | None:
    """Positions of the links, each beside the size of its motion."""
    encoder = moved.robot.link_encoder
    if encoder is None:
        return None
    measured = moved.measured(encoder.name)
    size = _sizes(measured)

    def equations(T: Array) -> Equations:
        stretched = T[None] * moved.load(T)[:, None, :]
        return [(measured / size, moved.now.q @ T.T / size, stretched / size[:, None])]

    return Told(encoder.name, stated_matrix(moved.robot), equations)


def seen_by_gyros(moved: Moved) -> Told | None:
    """Rates of all bodies with a gyro, as one system, since all see the same springs."""
    robot = moved.robot
    if not robot.gyros:
        return None
    measured = [(moved.measured(gyro.name) @ gyro.R_imu_body, gyro) for gyro in robot.gyros]
    T = stated_matrix(robot)

    def rate(gyro: Gyro, matrix: Array, v: Array) -> Array:
        return robot.tree.body_rate(gyro.body, moved.now.q @ matrix.T, v @ matrix.T)[0]

    def equations(matrix: Array) -> Equations:
        stretching = (moved.load(matrix, moved.after) - moved.load(matrix, moved.before)) / (0.5 * moved.window)
        parts = [stretching * one for one in np.eye(robot.n)]
        found = [
            (seen, rate(gyro, matrix, moved.now.v), np.stack([rate(gyro, matrix, part) for part in parts], axis=2))
            for seen, gyro in measured
        ]
        seen, said, fitted = (np.concatenate(columns, axis=1) for columns in zip(*found, strict=True))
        return [(seen, said, fitted)]

    def turned() -> float:
        """What is left with the file's matrix and each gyro mounted as it fits best."""
        size = left = 0.0
        for seen, gyro in measured:
            y, z = (x - x.mean(axis=0) for x in (seen, rate(gyro, T, moved.now.v)))
            size += float(np.sum(y**2))
            left += min(float(np.sum((y - z @ axes.T) ** 2)) for axes in map(axes_matrix, ALL_AXES))
        return float(np.sqrt(left / max(size, 1e-300)))

    return Told(" and ".join(gyro.name for gyro in robot.gyros), T, equations, turned)


def seen_by_drives(moved: Moved) -> Told:
    """Commands, each beside its own size; where they are torques, with the factor one."""
    robot = moved.robot
    measured = moved.measured("command")
    size = _sizes(measured)
    dry = np.tanh(moved.now.v / REVERSAL)
    known = robot.command.unit in ("N m", "N")

    def equations(T: Array) -> Equations:
        load = moved.load(T)
        found = []
        for i in range(robot.n):
            own = [moved.now.a[:, i], moved.now.v[:, i], dry[:, i]] + [load[:, i]] * (not known)
            said = load[:, i] if known else np.zeros(len(load))
            columns = measured[:, i, None], said[:, None], np.stack(own, axis=1)[:, None]
            found.append(tuple(column / size[i] for column in columns))
        return found

    return Told("the command", stated_matrix(robot), equations, bar=DRIVES)


def _sizes(measured: Array) -> Array:
    """Standard deviation of each column, shape (k,); infinite of one that stands still, which then says nothing."""
    size = np.std(measured, axis=0)
    return np.asarray(np.where(size > STANDS * np.max(np.abs(measured), axis=0, initial=0.0), size, np.inf))
