# SPDX-License-Identifier: BSD-3-Clause
"""The classical way, for comparison: one simulation through the whole recording, fitted by scipy's least squares.

Unknowns: 12 drive parameters as logarithms, first deflections, gyro biases and mounting rotations. Residuals: every
encoder and gyro sample over its sigma, and the prior of the rotations, without which the yaw of imu1 is undetermined.
The model has no process noise, which is right for the recordings used here and for no real robot.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from chain_simulation import PARAMETERS, body_rates, check_against, inertias_of, simulate_all
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem, first_command_time
from jointscope.graphs.problem.windows import windows_of
from jointscope.graphs.starts.initial_guess import initial_biases, initial_dynamics, initial_states
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

DEFLECTION = slice(PARAMETERS, PARAMETERS + 3)
SIMULATED = PARAMETERS + 3  # the unknowns that change the path
BIAS, ROTATION = slice(15, 21), slice(21, 27)
UNKNOWNS = 27
STEP = 1e-6  # of the forward differences
MOST_EVALUATIONS = 50
WORST_RESIDUAL = 1e6  # [sigma] stands in for a simulation that diverged


@dataclass(frozen=True)
class Shot:
    """What single shooting found.

    Attributes:
        parameters: the 12 drive parameters in the order of the robot file.
        seconds: time it took, without compiling [s].
        evaluations, jacobians: how often it simulated, and how often all derivatives.
        rms: root mean square of all residuals [sigma]; 1 is a perfect fit.
        converged: whether least_squares says so.
    """

    parameters: Array
    seconds: float
    evaluations: int
    jacobians: int
    rms: float
    converged: bool


class SingleShooting:
    """The residuals of one recording as a function of the unknowns.

    Args:
        robot: Doggy, with the start values.
        recording: all samples at the stamps of the commands, at rest in the beginning.
    """

    def __init__(self, robot: Robot, recording: Recording):
        check_against(robot.tree)
        self._problem = BagProblem.of(robot, recording)
        self._robot, self._recording = robot, recording
        timeline = self._problem.timeline
        self._volts, self._h = robot.command_volts * timeline.u, float(np.median(timeline.h))
        self._inertias, self._sharpness = inertias_of(robot.tree), robot.choices.friction_sharpness
        self._encoder = recording.streams[robot.motor_encoder.name]
        if not self._problem.rests or len(self._encoder) != len(timeline.ticks):
            raise AssertionError("single shooting: expected a rest at the start and one encoder sample per tick")
        resting = self._encoder.between(-np.inf, first_command_time(recording)).values
        self._q_motor = resting.mean(axis=0)
        self._paths(np.zeros((1, UNKNOWNS)), steps=2)  # compiles

    def start(self, regression: bool) -> Array:
        """Where to begin: biases from the rest; parameters of the robot file, or of `calibrate`'s regression."""
        calibration = initial_biases(self._problem, Calibration.of(self._robot))
        if regression:
            windows = [BagProblem.of(self._robot, piece) for _, piece in windows_of([self._recording])]
            calibration = initial_dynamics(windows, [initial_states(w, calibration) for w in windows], calibration)
        biases = np.concatenate([calibration.biases[gyro.name] for gyro in self._robot.gyros])
        return np.concatenate([calibration.dynamics, np.zeros(3), biases, np.zeros(6)])

    def fit(self, start: Array, method: str) -> Shot:
        """Least squares from a start with a method of scipy: "lm" (MINPACK) or "trf" (trust region)."""
        started = time.perf_counter()
        found = least_squares(
            self.residuals, start, self.jacobian, method=method, x_scale="jac", max_nfev=MOST_EVALUATIONS
        )
        seconds = time.perf_counter() - started
        rms = float(np.sqrt(np.mean(found.fun**2)))
        parameters = np.exp(found.x[:PARAMETERS])
        return Shot(parameters, seconds, found.nfev, found.njev or 0, rms, bool(found.success))

    def residuals(self, unknowns: Array) -> Array:
        """All residuals in sigmas, flat."""
        return self._measured(self._paths(unknowns[None])[0], unknowns)

    def jacobian(self, unknowns: Array) -> Array:
        """Forward differences; biases and rotations need no simulation of their own."""
        moved = unknowns + STEP * np.eye(UNKNOWNS)
        paths = self._paths(np.vstack([unknowns, moved[:SIMULATED]]))
        here = self._measured(paths[0], unknowns)
        columns = np.empty((len(here), UNKNOWNS), order="F")
        for j in range(UNKNOWNS):
            path = paths[j + 1] if j < SIMULATED else paths[0]
            columns[:, j] = (self._measured(path, moved[j]) - here) / STEP
        return columns

    def _paths(self, unknowns: Array, steps: int | None = None) -> Array:
        """States of each set of unknowns, shape (r, m + 1, 12)."""
        x0 = np.zeros((len(unknowns), 12))
        x0[:, :3] = self._q_motor + unknowns[:, DEFLECTION]
        x0[:, 6:9] = self._q_motor
        parameters = np.exp(unknowns[:, :PARAMETERS])
        return simulate_all(x0, self._volts[:steps], self._h, parameters, self._inertias, self._sharpness)

    def _measured(self, path: Array, unknowns: Array) -> Array:
        """Residuals of a path."""
        parts = [(path[:, 6:9] - self._encoder.values) / self._robot.motor_encoder.sigmas]
        rotations, biases = unknowns[ROTATION].reshape(2, 3), unknowns[BIAS].reshape(2, 3)
        for gyro, omega_body, turn, bias in zip(self._robot.gyros, body_rates(path), rotations, biases, strict=True):
            R_imu_body = gyro.R_imu_body @ Rotation.from_rotvec(turn).as_matrix()
            predicted = omega_body @ R_imu_body.T + bias
            parts.append((predicted - self._recording.streams[gyro.name].values) / gyro.sigma)
        held = [turn / gyro.R_prior_sigma for gyro, turn in zip(self._robot.gyros, rotations, strict=True)]
        flat = np.concatenate([part.ravel() for part in (*parts, *held)])
        return np.clip(np.nan_to_num(flat, nan=WORST_RESIDUAL), -WORST_RESIDUAL, WORST_RESIDUAL)
