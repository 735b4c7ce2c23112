# SPDX-License-Identifier: BSD-3-Clause
"""Linear equations between sensors that need no masses: the gear of each joint, and each gyro.

    gear of joint j   q_motor - q_link = zero + compliance tau + delay v_link + ...      (zero: one per recording)
    gyro i            omega_measured = R_imu_body J(q_link) v_link + bias + ...          (bias: one per recording)

Every effect is a column that its size multiplies; at size zero the equation is the one of rigid joints and sensors that
are in time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.transmission.joint_signals import (
    PERIODS,
    JointSignals,
    at,
    away_from_gaps,
    joint_signals,
    link_stream,
    mean_at,
    speed_window,
)
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Gyro
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

SOFT_SIGN = 0.05  # share of the largest torque within which a gap's side is undecided
DIFFERENCE = 1e-3  # [s] step of derivatives by time


@dataclass(frozen=True)
class Equation:
    """One equation in one recording.

    Attributes:
        name: "joint1.gear" or "imu2".
        unit: of the error.
        sigma: noise of the error.
        times: shape (m,) [s].
        error: measured - predicted, shape (m, c).
        constants: columns of what each recording has for itself, shape (m, c, b).
        columns: by full name of the parameter that multiplies it, shape (m, c) each.
        position: of the link, shape (m,) [rad]; None for gyros.
    """

    name: str
    unit: str
    sigma: float
    times: Array
    error: Array
    constants: Array
    columns: Mapping[str, Array]
    position: Array | None = None


def equations(recording: Recording, robot: Robot, values: Mapping[str, float]) -> list[Equation]:
    """All equations of a recording.

    Args:
        recording: the data.
        robot: the model.
        values: delays of gyros at which these are evaluated, by full name [s]; what is missing is zero.
    """
    robot = robot.in_posture(recording.posture)
    signals = joint_signals(recording, robot)
    gears = [gear_equation(signals, robot, j) for j in range(robot.n)]
    gyros = [gyro_equation(recording, robot, g, values.get(delay_name(g), 0.0)) for g in robot.gyros]
    return [*gears, *gyros]


def delay_name(gyro: Gyro) -> str:
    """Full name of a gyro's delay."""
    return f"{gyro.name}.gyro_delay.delay"


def gear_equation(s: JointSignals, robot: Robot, j: int) -> Equation:
    """Motor against link of one joint."""
    joint, encoder = robot.joints[j], robot.link_encoder
    assert encoder is not None
    v, q = s.v[:, j], s.q[:, j]
    columns = {
        f"{encoder.name}.encoder_delay.delay": v,
        # the encoder on the motor may be the late one
        f"{joint}.encoder_delay.delay": -v,
        f"{joint}.encoder_eccentricity.cos": np.cos(q),
        f"{joint}.encoder_eccentricity.sin": np.sin(q),
    }
    if s.torque is not None:
        tau = s.torque[:, j]
        columns |= {
            f"{joint}.joint_elasticity.compliance": tau,
            f"{joint}.backlash.half_gap": np.tanh(tau / (SOFT_SIGN * float(np.abs(tau).max() or 1.0))),
            f"{joint}.spring_cubic.stiffness": -(tau**3),
        }
        if robot.torque_sensor is None:  # friction stays on the motor's side of the gear
            columns[f"{joint}.motor_viscous.coefficient"] = -v
            columns[f"{joint}.coulomb_torque"] = -np.tanh(robot.sharpness_of(joint) * v)
    sigma = float(np.hypot(robot.motor_encoder.sigmas[j], encoder.sigmas[j]))
    constants = np.ones((len(q), 1, 1))
    shaped = {name: column[:, None] for name, column in columns.items()}
    return Equation(
        f"{joint}.gear", robot.unit_at(joint, "rad"), sigma, s.times, s.deflection[:, [j]], constants, shaped, q
    )


def gyro_equation(recording: Recording, robot: Robot, gyro: Gyro, delay: float) -> Equation:
    """A gyro against the links; its samples are compared with the motion `delay` seconds earlier."""
    stream, link = recording.streams[gyro.name], link_stream(recording, robot)
    window = max(speed_window(link), speed_window(stream))
    first, last = max(link.times[0] + delay, stream.times[0]), min(link.times[-1] + delay, stream.times[-1])
    margin = window / 2 + DIFFERENCE
    kept = (stream.times >= first + margin) & (stream.times <= last - margin)
    kept &= away_from_gaps(stream, stream.times, window) & away_from_gaps(link, stream.times - delay, window)
    kept &= recording.are_judged(stream.times)
    times = stream.times[kept]

    def rate(moments: Array) -> Array:
        zero = robot.link_encoder.zero if robot.link_encoder is not None else 0.0
        turned = at(link, moments + window / 2) - at(link, moments - window / 2)
        return robot.tree.body_rate(gyro.body, at(link, moments) - zero, turned / window)[0]

    R, omega = gyro.R_imu_body, rate(times - delay)
    slope = (rate(times - delay + DIFFERENCE) - rate(times - delay - DIFFERENCE)) / (2.0 * DIFFERENCE)
    turn = np.stack([np.cross(axis, omega) @ R.T for axis in np.eye(3)], axis=2)
    columns = {delay_name(gyro): -slope @ R.T}
    columns |= {f"{gyro.name}.R_imu_body.{axis}": turn[:, :, k] for k, axis in enumerate("xyz")}
    constants = np.broadcast_to(np.eye(3), (len(times), 3, 3))
    error = mean_at(stream, times, window) - omega @ R.T
    sigma = gyro.sigma / float(np.sqrt(PERIODS))  # of a mean over the window; the same in every recording
    return Equation(gyro.name, "rad/s", sigma, times, error, constants, columns)
