# SPDX-License-Identifier: BSD-3-Clause
"""An extended Kalman filter with the estimator's model and noise, in plain numpy: what one would write by hand.

    predict   x1 = RK4(x0, u, h)          P1 = F P0 F' + Q     F by central differences of the whole step
    update    K = P H' (H P H' + R)^-1    one sensor after the other, H of the gyros by central differences

The state is the robot's, then the biases of the gyros.
"""

from __future__ import annotations

import numpy as np
from message_feed import SAME, Message, in_order
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.estimator import BIAS_WALK
from jointscope.graphs.fixed_lag.messages.sample_checks import SampleChecks
from jointscope.graphs.problem.bag_problem import DEFLECTION_SIGMA
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

STEP = 1e-6  # [rad], [rad/s] of difference quotients
STILL = 0.01  # [rad/s] uncertainty of the velocities at the beginning, where the robot rests


class KalmanFilter:
    """Estimates a robot's state tick by tick from messages without gaps.

    Args:
        robot: with every gyro in full.
        q: first reading of the encoders, shape (n,) [rad].
    """

    def __init__(self, robot: Robot, q: Array):
        self._robot, self._layout, self._tree = robot, robot.layout, robot.kinematic_tree
        self._joints = ElasticJoints(robot)
        self._parameters = np.array([robot.parameters[name].value for name in self._joints.names])
        M = self._tree.mass_matrix(np.zeros((1, self._layout.n_link)))[0]
        self._alone = 1.0 / np.diag(np.linalg.inv(M))
        d, layout = self._layout.size, self._layout
        self.x = np.concatenate([np.zeros(d), *(gyro.bias for gyro in robot.gyros)])
        self.x[layout.joint_q] = self.x[layout.motor_q] = q - robot.motor_encoder.zero
        sigma = np.concatenate([np.full(d, STILL), *(np.full(3, g.bias_prior_sigma) for g in robot.gyros)])
        sigma[layout.q_link], sigma[layout.q_motor] = DEFLECTION_SIGMA, robot.motor_encoder.sigmas
        self.P = np.diag(sigma**2)

    def predict(self, u: Array, h: float) -> None:
        """One step of length h [s] with a command, shape (n,)."""
        d, x0 = self._layout.size, self.x[: self._layout.size]
        paths = self._runge_kutta(np.vstack([x0, x0 + STEP * np.eye(d), x0 - STEP * np.eye(d)]), u, h)
        F = np.eye(len(self.x))
        F[:d, :d] = (paths[1 : d + 1] - paths[d + 1 :]).T / (2.0 * STEP)
        self.P = F @ self.P @ F.T
        self.P[:d, :d] += self._noise(x0, h)
        self.P.flat[:: len(self.x) + 1] += np.r_[np.zeros(d), np.full(len(self.x) - d, BIAS_WALK**2 * h)]
        self.x[:d] = paths[0]

    def update(self, message: Message, widened: float | Array = 1.0) -> None:
        """Takes in a sample at the newest tick; `widened` is a factor on the sigma of its channels."""
        robot, layout, d = self._robot, self._layout, self._layout.size
        H = np.zeros((len(message.values), len(self.x)))
        if message.stream == robot.motor_encoder.name:
            H[np.arange(robot.n), layout.motor_q] = 1.0
            predicted, sigma = H @ self.x + robot.motor_encoder.zero, robot.motor_encoder.sigmas
        else:
            i = [gyro.name for gyro in robot.gyros].index(message.stream)
            bias, n = slice(d + 3 * i, d + 3 * i + 3), 2 * layout.n_link
            x0 = self.x[:n]
            rates = self._rate(i, np.vstack([x0, x0 + STEP * np.eye(n), x0 - STEP * np.eye(n)]))
            H[:, :n], H[:, bias] = (rates[1 : n + 1] - rates[n + 1 :]).T / (2.0 * STEP), np.eye(3)
            predicted, sigma = rates[0] + self.x[bias], robot.gyros[i].sigma
        PHt = self.P @ H.T
        S = H @ PHt + np.eye(len(H)) * (sigma * widened) ** 2
        K = np.linalg.solve(S, PHt.T).T
        self.x = self.x + K @ (message.values - predicted)
        P = self.P - K @ PHt.T
        self.P = 0.5 * (P + P.T)

    def _runge_kutta(self, x: Array, u: Array, h: float) -> Array:
        """Many states, shape (m, d), over one step."""
        k1 = self._slope(x, u)
        k2 = self._slope(x + 0.5 * h * k1, u)
        k3 = self._slope(x + 0.5 * h * k2, u)
        return x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + self._slope(x + h * k3, u))

    def _slope(self, x: Array, u: Array) -> Array:
        slope = np.zeros_like(x)
        slope[:, self._layout.positions] = x[:, self._layout.velocities]
        slope[:, self._layout.rates] = self._joints.accelerations(x, np.tile(u, (len(x), 1)), self._parameters)
        return slope

    def _rate(self, i: int, moving: Array) -> Array:
        """Reading of a gyro without bias, shape (m, 3), for link positions and velocities of shape (m, 2 n_link)."""
        gyro, (q, v) = self._robot.gyros[i], np.hsplit(moving, 2)
        return self._tree.body_rate(gyro.body, q, v)[0] @ gyro.R_imu_body.T

    def _noise(self, x: Array, h: float) -> Array:
        """White torques: velocities walk by S h, positions follow."""
        layout, noise = self._layout, self._robot.noise
        root = np.diag(np.concatenate([noise.link_velocity, noise.motor_velocity]))
        M = self._tree.mass_matrix(x[None, layout.q_link])[0]
        n = layout.n_link
        root[:n, :n] = np.linalg.inv(M) @ np.diag(self._alone * noise.link_velocity)
        S = root @ root.T
        Q = np.zeros((len(x), len(x)))
        q, v = layout.positions, layout.velocities
        Q[np.ix_(v, v)], Q[np.ix_(q, q)] = S * h, S * h**3 / 3.0
        Q[np.ix_(q, v)] = Q[np.ix_(v, q)] = S * h**2 / 2.0
        return Q


def filtered(robot: Robot, recording: Recording, like_ours: bool, since: float = 0.0) -> tuple[Array, Array]:
    """States with all samples of each tick.

    Args:
        robot: with every gyro in full.
        recording: all stamps at ticks; begins at rest.
        like_ours: whether samples of a quantized encoder count for less in slow motion, as they do in the estimator.
        since: when the filter begins; what came before only tells how coarse the encoder is [s].

    Returns:
        Times, shape (m,) [s], and states, shape (m, d).
    """
    name, messages = robot.motor_encoder.name, in_order(recording)
    checks = SampleChecks(robot.motor_encoder.sigmas.tolist(), False)
    kalman = KalmanFilter(robot, recording.streams[name].values[0])
    u, now = np.zeros(robot.n), max(messages[0].stamp, since)
    times, states = list[float](), list[Array]()
    for message in messages:
        if message.stamp > now + SAME:
            times.append(now)
            states.append(kalman.x[: robot.layout.size].copy())
            kalman.predict(u, message.stamp - now)
            now = message.stamp
        widened: float | Array = 1.0
        if message.stream == name and like_ours:
            shared = checks.shared_error(message.stamp, message.values.tolist())
            widened = 1.0 if shared is None else np.array(shared)
        if message.stream == "command":
            u = message.values
        elif message.stamp > since - SAME:
            kalman.update(message, widened)
    return np.array([*times, now]), np.array([*states, kalman.x[: robot.layout.size]])
