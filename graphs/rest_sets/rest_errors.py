# SPDX-License-Identifier: BSD-3-Clause
"""How well a robot says where its links come to rest, from its motors and the loads alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f

from jointscope.factors.calibration import Calibration
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.robots.model.robot import Robot
from jointscope.robots.rests.at_encoders import encoder_errors

Array = NDArray[np.float64]
FEWEST = 8  # rests beyond the values of a regression, from which it says something
SURELY = 3.0  # [sigma] of the encoders' noise in a torque that is missing for sure


@dataclass(frozen=True)
class RestErrors:
    """Errors of m rests.

    Attributes:
        position: links measured less predicted, shape (m, n) [rad]; zero without link encoders.
        residual: the same in sigmas of each rest.
        torque: torques that are missing for equilibrium where links and motors were measured, shape (m, n) [N m].
        friction: what friction holds beyond its band, of motors that had moved, shape (m, n) [N m].
        certain: the same less what noise of the encoders may be, shape (m, n) [N m].
        half: half widths of the bands, shape (m, n) [N m].
        creeping: torques that are missing where motors creep with their whole friction, shape (m, n) [N m]; zero where
            they stand.
        held: torques that friction holds, shape (m, n) [N m]; no numbers where a motor has not moved since the last
            rest, or a spring stands between it and its link.
        weights: torques of known loads and of gravity there, shape (m, n, 2) [N m].
    """

    position: Array
    residual: Array
    torque: Array
    friction: Array
    certain: Array
    half: Array
    creeping: Array
    held: Array
    weights: Array

    @property
    def off_creeping(self) -> Array:
        """Root mean square of what is missing where each motor creeps, shape (n,) [N m]; zero where none does."""
        count = np.sum(self.creeping != 0.0, axis=0)
        return np.asarray(np.sqrt(np.sum(self.creeping**2, axis=0) / np.maximum(count, 1)))

    def following(self, j: int) -> tuple[float, float]:
        """Share of what friction of a rigid joint holds that goes with loads and gravity, and how likely by chance.

        Friction holds whatever is asked within its band, either way: it knows nothing of what hangs there, unless the
        loads, their directions or masses are not what the file says, or nobody moved the joint as weights changed.
        """
        known = np.isfinite(self.held[:, j])
        y, columns = self.held[known, j], self.weights[known, j]
        columns = columns[:, np.ptp(columns, axis=0) > 0.0] if len(columns) else columns
        left, k = len(y) - 1 - columns.shape[1], columns.shape[1]
        if left < FEWEST or k == 0:
            return 0.0, 1.0
        A = np.column_stack([np.ones(len(y)), columns / np.abs(columns).max(axis=0)])
        rest = float(np.sum((y - A @ np.linalg.lstsq(A, y)[0]) ** 2))
        whole = float(np.sum((y - y.mean()) ** 2))
        if not whole > 0.0:
            return 0.0, 1.0
        F = (whole - rest) / k / max(rest / left, 1e-12 * whole)
        return 1.0 - rest / whole, float(f.sf(F, k, left))

    @property
    def bands(self) -> Array:
        """Median half width of each motor's band, shape (n,) [N m]."""
        return np.asarray(np.median(self.half, axis=0))

    @property
    def error(self) -> float:
        """Root mean square residual [sigma]; 1 is expected."""
        return _rms(self.residual)

    def to_json(self, robot: Robot) -> dict[str, Any]:
        """By channel of the link encoders, and torques by joint."""
        return {
            f"{joint}.link_position": {
                "rmse": _rms(self.position[:, i]),
                "chi2": _rms(self.residual[:, i]) ** 2,
                "unit": robot.unit_at(joint, "rad"),
            }
            for i, joint in enumerate(robot.joints)
        }

    def torques(self, robot: Robot) -> dict[str, float]:
        """Root mean square missing torque of each joint [N m]."""
        return {joint: _rms(self.torque[:, i]) for i, joint in enumerate(robot.joints)}

    def beyond(self, robot: Robot) -> dict[str, float]:
        """Largest torque of each joint that friction would have to hold beyond its band [N m]."""
        largest = self.friction.max(axis=0, initial=0.0)
        return {joint: float(largest[i]) for i, joint in enumerate(robot.joints)}


def rest_errors(problems: Sequence[RestSet]) -> RestErrors:
    """Errors of the robot's own values; nothing is fitted."""
    found = [_of(problem) for problem in problems]
    return RestErrors(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _of(problem: RestSet) -> tuple[Array, ...]:
    robot, rests = problem.robot, problem.rests
    measured, calibration = problem.start(Calibration.of(robot))
    predicted = problem.predicted()
    columns = robot.layout.joint_link
    seen = np.zeros_like(rests.q_motor)
    if rests.q_link is not None:
        values, q = robot.values, predicted[:, columns]
        seen = rests.q_link - q - encoder_errors(robot, q, values, on_links=True).value
    torques = problem.torques(measured, calibration)
    missing = np.zeros((len(rests), robot.layout.n_link))
    missing[:, problem.held] = torques.links.value
    held = torques.held
    beyond = np.abs(held.value) - torques.half.value
    friction = np.where(rests.moved, np.maximum(beyond, 0.0), 0.0)
    # how far motors are off moves the links as well
    motor, link = problem.encoder_sigmas()
    certain = np.maximum(friction - SURELY * _noise(problem, held.by_position, motor, link), 0.0)
    sigma = np.hypot(link, motor) if rests.q_link is not None else np.ones_like(seen)
    creeping = np.where(rests.creep != 0.0, torques.sliding.value, 0.0)
    rigid = np.array([joint not in robot.layout.motors for joint in robot.joints])
    weights = np.stack(problem.weights(measured[:, robot.layout.q_link]), axis=2)[:, columns]
    asked = np.where(rests.moved & rigid, held.value, np.nan)
    return seen, seen / sigma, missing[:, columns], friction, certain, torques.half.value, creeping, asked, weights


def _noise(problem: RestSet, slopes: Array, motor: Array, link: Array) -> Array:
    """Sigma of torques with derivatives by positions, shape (m, n, d), that encoders leave, shape (m, n) [N m]."""
    layout = problem.robot.layout
    squares = np.zeros(slopes.shape[:2])
    for columns, sigma in ((layout.motor_q, motor), (layout.joint_q, link)):
        if np.all(np.isfinite(sigma)):
            squares += np.sum((slopes[:, :, problem.places(columns)] * sigma[:, None, :]) ** 2, axis=2)
    return np.sqrt(squares)


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2))) if x.size else 0.0
