# SPDX-License-Identifier: BSD-3-Clause
"""The motion that the arms are asked for: sums of sines that start from rest and stay within the limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from arm_urdf import UrdfJoint
from numpy.typing import NDArray

Array = NDArray[np.float64]
SINES = 5
LOWEST, HIGHEST = 0.15, 2.0  # [Hz]
TURN, SLIDE = (0.7, 1.3), (0.1, 0.25)  # widths of the motion [rad], [m]
SHARE = 0.6  # of the range between the limits
SPEED_SHARE = 0.9  # of the limit of the velocity
PLACEHOLDER = 0.01  # of the speed of the motion
RAMP = 0.6  # [s] until the motion has its full size
STEP = 1e-4  # [s] of the differences that give velocity and acceleration


@dataclass(frozen=True)
class Motion:
    """Where each joint shall be.

    Attributes:
        centre: posture from which it starts, shape (n,) [rad or m].
        amplitudes, frequencies, phases: of each joint's sines, shape (n, SINES) [rad or m, Hz, rad].
    """

    centre: Array
    amplitudes: Array
    frequencies: Array
    phases: Array

    def position(self, t: float) -> Array:
        """Wanted position, shape (n,)."""
        sines = self.amplitudes * np.sin(2 * np.pi * self.frequencies * t + self.phases)
        s = min(max(t / RAMP, 0.0), 1.0)
        return self.centre + s**3 * (10 - 15 * s + 6 * s**2) * sines.sum(axis=1)

    def at(self, t: float) -> tuple[Array, Array, Array]:
        """Position, velocity and acceleration, each of shape (n,)."""
        before, now, after = (self.position(t + k * STEP) for k in (-1, 0, 1))
        return now, (after - before) / (2 * STEP), (after - 2 * now + before) / STEP**2


def make_motion(joints: Sequence[UrdfJoint], centre: Array, rng: np.random.Generator) -> Motion:
    """Sines at random frequencies, smaller the faster; all stay between the limits of their joint."""
    n = len(joints)
    frequencies = np.exp(rng.uniform(np.log(LOWEST), np.log(HIGHEST), (n, SINES)))
    phases = rng.uniform(0, 2 * np.pi, (n, SINES))
    motion = Motion(centre, frequencies**-0.5, frequencies, phases)
    times = np.arange(0.0, 10.0, 0.01)
    away = np.array([motion.position(t) for t in times]) - centre
    speeds = np.abs(np.diff(away, axis=0)).max(axis=0) / 0.01
    sizes = np.empty(n)
    for k, joint in enumerate(joints):
        low, high = SLIDE if joint.kind == "prismatic" else TURN
        width = min(rng.uniform(low, high), SHARE * (joint.upper - joint.lower))
        sizes[k] = width / np.ptp(away[:, k])
        # limits that would leave nothing of the motion are placeholders
        if joint.speed > PLACEHOLDER * speeds[k] * sizes[k]:
            sizes[k] = min(sizes[k], SPEED_SHARE * joint.speed / speeds[k])
        margin = 0.02 * (joint.upper - joint.lower) if np.isfinite(joint.upper) else 0.0
        room = (joint.upper - centre[k] - margin, centre[k] - joint.lower - margin)
        for reach, free in zip((away[:, k].max(), -away[:, k].min()), room, strict=True):
            sizes[k] = min(sizes[k], free / reach)
    return Motion(centre, motion.amplitudes * sizes[:, None], frequencies, phases)
