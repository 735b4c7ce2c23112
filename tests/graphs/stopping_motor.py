# SPDX-License-Identifier: BSD-3-Clause
"""A lever behind a spring whose motor truly sticks and slips, driven from posture to posture by a controller.

After each motion the link swings on, and takes the motor along until friction holds it. Integrated here, with friction
that is a force within its band while the motor stands; angles count from hanging.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.recording import Recording, Stream

Array = NDArray[np.float64]
RATE, FINE = 200.0, 20  # [Hz] of all streams, and steps of integration from one sample to the next
WEIGHT = 2.0 * 9.81 * 0.3  # [N m] of the rod of lever_bench.py, where it is level
INERTIA, ROTOR = 0.02 + 2.0 * 0.3**2, 0.05  # [kg m2] of the link and of the motor
STIFFNESS, SPRING_DAMPING, VISCOUS = 40.0, 0.06, 0.3  # [N m/rad], [N m s/rad] twice
STEPS = 1.0e-5, 2.0e-4  # [rad] noise of the encoders on the motor and on the link
GAIN, BRAKE = 60.0, 3.0  # of the controller [N m/rad] and [N m s/rad]
MOVING, HELD = 0.7, 2.5  # [s]


def visited(postures: Array, friction: float, seed: int) -> Recording:
    """The recording of a tour of postures, shape (m,) [rad], with dry friction [N m]."""
    rng = np.random.default_rng(seed)
    count = int((MOVING + HELD) * RATE)
    x = np.array([postures[0], 0.0, postures[0] + WEIGHT * np.sin(postures[0]) / STIFFNESS, 0.0])
    rows, last = [], x[2]
    for goal in postures:
        target = goal + WEIGHT * np.sin(goal) / STIFFNESS
        for k in range(count):
            s = min(k / RATE / MOVING, 1.0)
            wanted = last + (target - last) * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
            motor, link = x[2] + STEPS[0] * rng.normal(), x[0] + STEPS[1] * rng.normal()
            u = GAIN * (wanted - motor) - BRAKE * x[3] + 0.9 * WEIGHT * np.sin(goal)
            rows.append((motor, link, u))
            for _ in range(FINE):
                x = _stepped(x, u, friction, 1.0 / RATE / FINE)
        last = target
    motors, links, commands = np.array(rows).T[:, :, None]
    times = np.arange(len(rows)) / RATE
    streams = {
        name: Stream(name, times, values, ("swing",), unit)
        for name, values, unit in (
            ("command", commands, "N m"), ("motor_angle", motors, "rad"), ("link_angle", links, "rad"),
        )
    }  # fmt: skip
    return Recording("tour", "", 0, streams)


def _stepped(x: Array, u: float, friction: float, h: float) -> Array:
    q, v, m, w = x
    spring = STIFFNESS * (m - q) + SPRING_DAMPING * (w - v)
    v += h * (spring - WEIGHT * np.sin(q) - 0.02 * v) / INERTIA
    pushed = u - spring - VISCOUS * w
    # what friction would have to be for the motor to stand at the end of the step
    needed = pushed + ROTOR * w / h
    w = 0.0 if abs(needed) <= friction else w + h * (pushed - np.sign(needed) * friction) / ROTOR
    return np.array([q + h * v, v, m + h * w, w])
