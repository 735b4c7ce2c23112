# SPDX-License-Identifier: BSD-3-Clause
"""Where the estimator begins: from the first hundredths of a second of encoder samples, at rest or in motion.

Motor positions and velocities come from a straight line through the encoder samples; links are where their motors are,
within what springs give way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.window.adaptation import prior_sigmas
from jointscope.graphs.fixed_lag.window.augmented_layout import AugmentedLayout
from jointscope.graphs.fixed_lag.window.newest_state import NewestState
from jointscope.graphs.fixed_lag.window.observation import Observation
from jointscope.graphs.problem.bag_problem import DEFLECTION_SIGMA
from jointscope.graphs.problem.dead_zone_edges import dead_zones
from jointscope.robots.dynamics.carried_weight import CarriedWeight
from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.model.encoder_plays import EncoderPlays
from jointscope.robots.model.lasting_torques import memory_spreads
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

WINDOW = 0.02  # [s] of encoder samples
FEWEST = 5  # encoder samples
LONGEST_WAIT = 0.5  # [s] between two samples that belong together; after half of it fewer must do
STILL = 4.0  # [sigma] spread of the encoders at rest
REST_VELOCITY = 0.01  # [rad/s] uncertainty at rest; friction holds a motor while the link may still swing a little
LINK_VELOCITY = 1.0  # [rad/s] of a link against its motor, in motion
ACCELERATION = 100.0  # [rad/s^2] at the most, where the samples do not tell
SURELY = 3.0  # [sigma] by which the acceleration may be larger than the one that they tell


@dataclass(frozen=True)
class EncoderSample:
    """Readings of the encoders: time [s] and positions without zero, shape (n,) [rad]; NaN where it lacks a joint."""

    time: float
    q: Array


class FirstSamples:
    """Encoder samples until there are enough.

    Args:
        robot: its encoders.
    """

    def __init__(self, robot: Robot):
        self._encoder, self._n = robot.motor_encoder, robot.n
        self.samples: list[EncoderSample] = []

    @property
    def newest(self) -> Array | None:
        """Newest positions, shape (n,) [rad]; None before all joints have one."""
        q = np.array([sample.q for sample in self.samples])
        if not len(q) or np.isnan(q).all(axis=0).any():
            return None
        last = len(q) - 1 - np.argmax(np.isfinite(q)[::-1], axis=0)
        return np.asarray(q[last, np.arange(self._n)], dtype=np.float64)

    def add(self, observations: Sequence[Observation]) -> bool:
        """Takes in the groups of channels of one message; returns whether the estimator can begin.

        Until it does, the newest samples that suffice are kept.
        """
        own = [o for o in observations if o.sensor == self._encoder.name]
        if not own:
            return False
        q = np.full(self._n, np.nan)
        for o in own:
            q[o.channels] = o.values
        taken, samples = own[0].taken, self.samples
        if samples and abs(taken - samples[-1].time) > LONGEST_WAIT:
            samples.clear()
        if samples and taken <= samples[-1].time:
            return False  # older than what is there
        samples.append(EncoderSample(taken, q - np.asarray(self._encoder.zero)))
        while len(samples) > 1 and _suffice(samples[1:]):
            del samples[0]
        return _suffice(samples)


def _suffice(samples: Sequence[EncoderSample]) -> bool:
    """Whether they tell where all joints are, and how fast."""
    span = samples[-1].time - samples[0].time
    count = int(np.isfinite([sample.q for sample in samples]).sum(axis=0).min())
    return (span >= WINDOW and count >= FEWEST) or (span >= LONGEST_WAIT / 2 and count > 1)


def first_state(
    robot: Robot,
    layout: AugmentedLayout,
    samples: Sequence[EncoderSample],
    walking: NewestState | None,
) -> tuple[float, NewestState]:
    """Time and Gaussian of the first tick.

    Args:
        robot: sensors with priors of their biases.
        layout: of the estimator's state.
        samples: encoder samples, in the order of time; at least two of every joint.
        walking: an earlier estimate whose biases and parameters go on; None for their priors.
    """
    own, sigma = layout.robot, robot.motor_encoder.sigmas
    t = np.array([s.time for s in samples])
    q = np.array([s.q for s in samples])
    now = float(t[-1])
    seen = np.isfinite(q)
    rests = bool(np.all(np.nanmax(q, axis=0) - np.nanmin(q, axis=0) < STILL * sigma))
    ways = [_velocity(t[has] - now, column[has], s) for column, has, s in zip(q.T, seen.T, sigma, strict=True)]
    v = np.zeros(robot.n) if rests else np.array([way for way, _ in ways])
    last = len(t) - 1 - np.argmax(seen[::-1], axis=0)
    since = now - t[last]  # [s] of joints that other messages tell of
    newest = q[last, np.arange(robot.n)] + v * since
    v_sigma = np.full(robot.n, REST_VELOCITY) if rests else np.array([doubt for _, doubt in ways])
    mean, variance = np.zeros(layout.size), np.zeros(layout.size)
    mean[own.motor_q], mean[own.motor_v] = newest, v
    mean[own.joint_q], mean[own.joint_v] = joint_angles(robot, newest), joint_angles(robot, v)
    variance[own.positions], variance[own.velocities] = DEFLECTION_SIGMA**2, np.max(v_sigma) ** 2
    links = np.arange(own.n_link)
    variance[own.n_link + links] += 0.0 if rests else LINK_VELOCITY**2
    variance[own.motor_q], variance[own.motor_v] = sigma**2 + (v_sigma * since) ** 2, v_sigma**2
    variance[own.memory] = memory_spreads(robot) ** 2
    if walking is None:
        for sensor in robot.biased:
            columns = layout.biases[sensor.name]
            mean[columns], variance[columns] = sensor.bias, sensor.bias_prior_sigma**2
        mean[layout.adapted] = [robot.parameters[name].value for name in layout.parameters]
        variance[layout.adapted] = prior_sigmas(robot, layout.parameters) ** 2
    found = NewestState(mean, np.diag(variance))
    if walking is not None:
        mean[layout.walking] = walking.mean[layout.walking]
        found.covariance[layout.walking, layout.walking] = walking.covariance[layout.walking, layout.walking]
    zones, plays = _in_dead_zones(robot, newest) if rests else [], EncoderPlays.of(robot)
    if zones or plays is not None:
        _tie(robot, found, zones, plays)
    return now, found


def _tie(robot: Robot, found: NewestState, zones: list[tuple[int, float, float]], plays: EncoderPlays | None) -> None:
    """Ties motors to what their encoders lag by, and links to their motors, by q_link = T (q_motor + deflection).

    An encoder with play knows where its reading is; the motor is ahead of it by a lag that nobody has seen.

    Args:
        robot: its layout and transmission.
        found: independent positions and lags; changed in place.
        zones: as `_in_dead_zones` finds them.
        plays: of its encoders; None for none.
    """
    layout, P, mean = robot.layout, found.covariance, found.mean
    if plays is not None:
        half = np.maximum(plays.sizes(robot.values), plays.corners)
        P[plays.lags, plays.lags] = half**2  # wider, and the side on which a lag is taken to be would be one beyond it
        for (sensor, _), lag, q in zip(plays.seats, plays.lags, plays.positions, strict=True):
            if sensor == robot.motor_encoder.name:
                P[q, q] += P[lag, lag]
                P[q, lag] = P[lag, q] = P[lag, lag]
    middle, doubt = np.zeros(robot.n), np.full(robot.n, DEFLECTION_SIGMA)
    for j, ahead, unsure in zones:
        middle[j], doubt[j] = ahead, unsure
    elastic = list(layout.elastic_joints)
    T = joint_angles(robot, np.eye(robot.n)).T[np.ix_(elastic, elastic)]
    links, motors = layout.joint_q[elastic], layout.motor_q[elastic]
    mean[links] += T @ middle[elastic]
    of_links = T @ P[motors]
    P[links], P[:, links] = of_links, of_links.T
    P[np.ix_(links, links)] = of_links[:, motors] @ T.T + T @ np.diag(doubt[elastic] ** 2) @ T.T


def _in_dead_zones(robot: Robot, q: Array) -> list[tuple[int, float, float]]:
    """Joints that rest on springs with a dead zone, how far their deflection is at rest, and its doubt [rad].

    It lies anywhere in the zone, and beyond it by what it weighs. A prior that is wider by far would be a certainty on
    the wrong side soon: an estimator that is linear learns from a spring's slope, and within the zone there is none.
    """
    zones = dead_zones(robot)
    if not zones:
        return []
    x = np.zeros((1, robot.layout.size))
    x[:, robot.layout.motor_q] = q
    x[:, robot.layout.joint_q] = joint_angles(robot, q)
    weight = CarriedWeight(robot).torque(x, robot.values)[0]
    found = []
    for j, begin, end in zones:
        stiffness = robot.parameters.get(f"{robot.joints[j]}.stiffness")
        if stiffness is not None:  # a spring that came as an effect has a compliance
            doubt = float(np.hypot(0.5 * (end - begin), weight[j] / stiffness.value))
            found.append((j, 0.5 * (begin + end), doubt))
    return found


def _velocity(t: Array, q: Array, sigma: float) -> tuple[float, float]:
    """Velocity at time zero from samples before it, and its standard deviation [rad/s].

    A wide one does harm: where a joint turns over, the slope of its dry friction holds within a few mrad/s only.

    Args:
        t: times [s], shape (k,).
        q: positions [rad], shape (k,).
        sigma: of a sample [rad].
    """
    span = float(max(t[-1] - t[0], 1e-4))
    line = float(np.polyfit(t, q, 1)[0]), float(np.hypot(4.0 * sigma / span, 0.5 * ACCELERATION * span))
    if len(t) < FEWEST:
        return line
    powers = np.vander(t / span, 3, increasing=True)
    (_, slope, bend), spread = (
        np.linalg.lstsq(powers, q)[0],
        sigma * np.sqrt(np.linalg.inv(powers.T @ powers).diagonal()),
    )
    bent = 2.0 * (abs(bend) + SURELY * spread[2]) / span**2
    if bent > ACCELERATION:
        return line
    return float(slope / span), float(np.hypot(spread[1] / span, 0.5 * bent * span))
