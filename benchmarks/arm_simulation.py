# SPDX-License-Identifier: BSD-3-Clause
"""Simulates an arm under commands that hold between their stamps, and samples it at stamps of its own.

    (M(q) + rotors) a + c(q, v) = k u - coulomb tanh(500 v) - viscous v

integrated by Runge and Kutta's rule of fourth order in steps that resolve the dry friction; where friction sticks, by
`arm_sticking.py`. The controller, which only
has to keep the arm on its way, is the inverse dynamics of the wanted motion with springs and dampers around it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from arm_bodies import ArmBodies
from arm_drives import SHARPNESS, Drives
from arm_motion import Motion
from arm_sticking import StickingArm
from numpy.typing import NDArray

Array = NDArray[np.float64]
LONGEST_STEP = 1e-3  # [s]
SHORTEST_STEP = 1e-4  # [s]
STIFF = 1.2  # of a step times the rate of the dry friction; Runge and Kutta's rule bears 2.8
FASTEST = 2 * np.pi * 4.0  # [rad/s] of the controller
PER_SAMPLE = 0.25  # [rad] of the controller's frequency in a period of the command
DAMPING = 0.7


@dataclass(frozen=True)
class Run:
    """What happened.

    Attributes:
        command_times, commands: stamps, shape (m,) [s], and commands, shape (m, n) [unit].
        state_times, positions, torques: stamps, shape (s,) [s], positions and motor torques then, shape (s, n).
    """

    command_times: Array
    commands: Array
    state_times: Array
    positions: Array
    torques: Array


def simulate(
    bodies: ArmBodies, drives: Drives, motion: Motion, command_times: Array, state_times: Array, digits: int = 6
) -> Run:
    """Runs from rest at time 0 to the last stamp; commands are rounded to `digits` as a driver's are."""
    q, v = motion.at(0.0)[0], np.zeros(len(bodies.joints))
    period = float(np.median(np.diff(command_times)))
    sticking = StickingArm(bodies, drives) if drives.sticks else None
    gains = _gains(bodies.mass_matrix(q) + np.diag(drives.inertia), period)
    step = _longest_step(bodies.mass_matrix(q) + np.diag(drives.inertia), drives)
    # before the first command the arm is held by its brakes
    events = sorted([(t, False) for t in command_times] + [(t, True) for t in state_times])
    now, u, driven = 0.0, np.zeros(len(q)), False
    commands, positions, torques = [], [], []
    for time, samples in events:
        if driven and sticking is not None:
            q, v = sticking.advance(q, v, drives.k * u, time - now)
        elif driven:
            q, v = _advance(bodies, drives, q, v, drives.k * u, time - now, step)
        now = time
        if samples:
            positions.append(q)
            torques.append(drives.k * u)
        else:
            u = _command(bodies, drives, motion, gains, time, period, q, v, digits)
            commands.append(u)
            driven = True
    return Run(command_times, np.array(commands), state_times, np.array(positions), np.array(torques))


def _command(
    bodies: ArmBodies,
    drives: Drives,
    motion: Motion,
    gains: tuple[Array, Array],
    now: float,
    period: float,
    q: Array,
    v: Array,
    digits: int,
) -> Array:
    """Inverse dynamics in the middle of the time for which the command holds, and what corrects the state."""
    q_wanted, v_wanted, a_wanted = motion.at(now + period / 2)
    M, bias = bodies.mass_and_bias(q_wanted, v_wanted)
    tau = M @ a_wanted + bias + drives.inertia * a_wanted + drives.friction(v_wanted)
    q_now, v_now, _ = motion.at(now)
    tau = tau + gains[0] * (q_now - q) + gains[1] * (v_now - v)
    return np.round(tau / drives.k, digits)


def _advance(
    bodies: ArmBodies, drives: Drives, q: Array, v: Array, tau: Array, duration: float, longest: float
) -> tuple[Array, Array]:
    """State after a time under a torque that holds."""
    if duration <= 0.0:
        return q, v
    steps = int(np.ceil(duration / longest))
    h = duration / steps

    def acceleration(q: Array, v: Array) -> Array:
        M, bias = bodies.mass_and_bias(q, v)
        return np.linalg.solve(M + rotors, tau - bias - drives.friction(v))

    rotors = np.diag(drives.inertia)
    for _ in range(steps):
        a1 = acceleration(q, v)
        v2 = v + h / 2 * a1
        a2 = acceleration(q + h / 2 * v, v2)
        v3 = v + h / 2 * a2
        a3 = acceleration(q + h / 2 * v2, v3)
        v4 = v + h * a3
        a4 = acceleration(q + h * v3, v4)
        q = q + h / 6 * (v + 2 * v2 + 2 * v3 + v4)
        v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return q, v


def _gains(M: Array, period: float) -> tuple[Array, Array]:
    """Springs and dampers by the inertia that each joint has to move."""
    rate = min(FASTEST, PER_SAMPLE / period)
    return np.diag(M) * rate**2, 2 * DAMPING * np.diag(M) * rate


def _longest_step(M: Array, drives: Drives) -> float:
    """Resolves the steepest part of the dry friction of the joint that it slows down fastest."""
    fastest = float(np.max(SHARPNESS * drives.coulomb * np.diag(np.linalg.inv(M))))
    return float(np.clip(STIFF / fastest, SHORTEST_STEP, LONGEST_STEP))
