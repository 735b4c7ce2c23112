# SPDX-License-Identifier: BSD-3-Clause
"""Equations between sensors that need no masses: the gear of each joint, and each gyro.

    gear of joint j   q_motor - q_link = zero + compliance tau + delay v_link + ...      (zero: one per recording)
    gyro i            omega_measured = R_imu_body J(q_link) v_link + bias + ...          (bias: one per recording)

Every effect is a column that its size multiplies; at size zero the equation is the one of rigid joints and sensors that
are in time. Torques are seen through the compliance: the size of a friction torque is compliance times torque.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.transmission.joint_signals import (
    PERIODS,
    JointSignals,
    at,
    away_from_gaps,
    link_stream,
    mean_at,
    speed_window,
)
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import AXES, Gyro
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

SOFT_SIGN = 0.05  # share of the largest torque within which a gap's side is undecided
DIFFERENCE = 1e-3  # [s] step of derivatives by time
RIPPLE = "encoder_eccentricity"
ELASTICITY = "joint_elasticity.compliance"
SEEN_THROUGH = {"coulomb_torque": 1, "motor_viscous.coefficient": 1, "spring_cubic.stiffness": 4}
"""Powers of the compliance that make the value of a parameter the size of its column."""


@dataclass(frozen=True)
class Equation:
    """One equation in one recording.

    Attributes:
        channels: ("joint1.gear",), or those of a gyro.
        unit: of the error.
        sigma: noise of the error.
        times: shape (m,) [s].
        measured: shape (m, c).
        predicted: without what the columns add and without constants, shape (m, c).
        columns: change of the prediction with each size, by full name of the parameter behind it, shape (m, c) each.
        position: of the link, shape (m,) [rad]; None for gyros.
    """

    channels: tuple[str, ...]
    unit: str
    sigma: float
    times: Array
    measured: Array
    predicted: Array
    columns: Mapping[str, Array]
    position: Array | None = None

    @property
    def name(self) -> str:
        """Of the gear ("joint1.gear") or the gyro ("imu2")."""
        return self.channels[0] if self.position is not None else self.channels[0].rsplit(".", 1)[0]


def sizes_of(values: Mapping[str, float]) -> dict[str, tuple[float, float, float]]:
    """The size that each value gives its column, and its derivatives by the value and by its joint's compliance."""
    found = {}
    for name, value in values.items():
        owner, law = name.split(".", 1)
        power = SEEN_THROUGH.get(law, 0)
        compliance = values.get(f"{owner}.{ELASTICITY}", 0.0)
        factor = compliance**power
        found[name] = value * factor, factor, value * power * compliance ** (power - 1) if power else 0.0
    return found


def delay_name(gyro: Gyro) -> str:
    """Full name of a gyro's delay."""
    return f"{gyro.name}.gyro_delay.delay"


def ripple_order(robot: Robot, joint: str) -> float:
    """Periods per turn of a joint's ripple; one where it has none."""
    order = robot.parameters.get(f"{joint}.{RIPPLE}.order")
    return 1.0 if order is None else order.value


def ripple(equation: Equation, joint: str, order: float, mark: str = "") -> Equation:
    """The gear equation of a joint with columns of a ripple; their names end with a mark."""
    assert equation.position is not None
    waves = {"cos": np.cos(order * equation.position), "sin": np.sin(order * equation.position)}
    columns = {f"{joint}.{RIPPLE}.{part}{mark}": wave[:, None] for part, wave in waves.items()}
    return replace(equation, columns={**equation.columns, **columns})


def gear_equation(s: JointSignals, robot: Robot, j: int) -> Equation:
    """Motor against link of one joint."""
    joint, encoder = robot.joints[j], robot.link_encoder
    assert encoder is not None
    v, q = s.v[:, j], s.q[:, j]
    # the encoder on the motor may be the late one
    columns = {f"{encoder.name}.encoder_delay.delay": v, f"{joint}.encoder_delay.delay": -v}
    if s.torque is not None:
        tau = s.torque[:, j]
        columns |= {
            f"{joint}.{ELASTICITY}": tau,
            f"{joint}.backlash.half_gap": np.tanh(tau / (SOFT_SIGN * float(np.abs(tau).max() or 1.0))),
            f"{joint}.spring_cubic.stiffness": -(tau**3),
        }
        if robot.torque_sensor is None:  # friction stays on the motor's side of the gear
            columns[f"{joint}.motor_viscous.coefficient"] = -v
            columns[f"{joint}.coulomb_torque"] = -np.tanh(robot.sharpness_of(joint) * v)
    sigma = float(np.hypot(robot.motor_encoder.sigmas[j], encoder.sigmas[j]))
    shaped = {name: column[:, None] for name, column in columns.items()}
    nothing = np.zeros((len(q), 1))
    unit = robot.unit_at(joint, "rad")
    rigid = Equation((f"{joint}.gear",), unit, sigma, s.times, s.deflection[:, [j]], nothing, shaped, q)
    return ripple(rigid, joint, ripple_order(robot, joint))


def gyro_equation(recording: Recording, robot: Robot, gyro: Gyro, R: Array, delay: float) -> Equation:
    """A gyro against the links.

    Args:
        recording: the data.
        robot: the model.
        gyro: the sensor.
        R: its mounting R_imu_body, shape (3, 3).
        delay: its samples are compared with the motion so much earlier [s].
    """
    stream, link = recording.streams[gyro.name], link_stream(recording, robot)
    window = max(speed_window(link), speed_window(stream))
    start = robot.parameters[delay_name(gyro)].value if delay_name(gyro) in robot.parameters else 0.0
    # always the samples that lie within the motion at the robot's own delay, or the cost would jump
    first, last = max(link.times[0] + start, stream.times[0]), min(link.times[-1] + start, stream.times[-1])
    margin = window / 2 + DIFFERENCE
    kept = (stream.times >= first + margin) & (stream.times <= last - margin)
    kept &= away_from_gaps(stream, stream.times, window) & away_from_gaps(link, stream.times - start, window)
    kept &= recording.are_judged(stream.times)
    times = stream.times[kept]

    def rate(moments: Array) -> Array:
        zero = robot.link_encoder.zero if robot.link_encoder is not None else 0.0
        turned = at(link, moments + window / 2) - at(link, moments - window / 2)
        return robot.tree.body_rate(gyro.body, at(link, moments) - zero, turned / window)[0]

    omega = rate(times - delay)
    slope = (rate(times - delay + DIFFERENCE) - rate(times - delay - DIFFERENCE)) / (2.0 * DIFFERENCE)
    columns = {delay_name(gyro): -slope @ R.T}
    for name, axis in zip(AXES, np.eye(3), strict=True):
        columns[f"{gyro.name}.R_imu_body.{name}"] = np.cross(axis, omega) @ R.T
    sigma = gyro.sigma / float(np.sqrt(PERIODS))  # of a mean over the window; the same in every recording
    return Equation(gyro.channels, "rad/s", sigma, times, mean_at(stream, times, window), omega @ R.T, columns)
