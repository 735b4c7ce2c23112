# SPDX-License-Identifier: BSD-3-Clause
"""What makes an arm at rest differ from a rigid one with perfect encoders, joint by joint.

    q_j = q_motor_j + r_j(q_motor_j) - a_j(q_motor_j) + e_j + x_j - sign(g_j) (w_j - h_j)
    r, a = c cos(o q_motor) + s sin(o q_motor)
    k x + k3 x^3 = g,    beta = g_beta / k_beta

a is the eccentricity of an encoder, what its reading has too much as in the catalogue (o = 1 unless a parameter says
otherwise), r the ripple of a gear (o waves per turn), e is what the transmission does unseen, g the torque of gravity,
w the backlash as Neubauer et al. (2015, eq. 18) have it, h half of the gap as springs in motion have it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.geometry.arm_chain import ChainPoint
from jointscope.robots.geometry.error_parameters import (
    BACKLASH,
    BEARING,
    CUBIC,
    HALF_GAP,
    RIPPLE,
    STIFFNESS,
    WAVES,
    WAVES_ORDER,
)

Array = NDArray[np.float64]
ROOTS = 12  # Newton steps to the deflection of a spring that hardens


class WhatGivesWay:
    """Drives, bearings, gaps and encoders of a chain at some values.

    Args:
        joints: of the chain.
        values: of all parameters; those that are not there do not act.
    """

    def __init__(self, joints: Sequence[str], values: Mapping[str, float]):
        self._joints, self._values = tuple(joints), values
        self._drives = self._there(STIFFNESS)
        self._gaps = [(j, name, -1.0) for j, name in self._there(BACKLASH).items()]
        self._gaps += [(j, name, 1.0) for j, name in self._there(HALF_GAP).items()]
        self._bearings = {(j, axis): name for axis, part in enumerate(BEARING) for j, name in self._there(part).items()}

    @property
    def some(self) -> bool:
        """Whether anything depends on the load."""
        return bool(self._drives or self._gaps or self._bearings)

    def waves(self, q: Array) -> Array:
        """What encoders and gears are off at angles of shape (m, n) [rad]."""
        off = np.zeros_like(q)
        for j, (cos, sin), sign, order in self._waves():
            phase = self._values.get(order, 1.0) * q[:, j]
            off[:, j] += sign * (self._values[cos] * np.cos(phase) + self._values[sin] * np.sin(phase))
        return off

    def deflections(self, point: ChainPoint) -> tuple[Array, Array]:
        """Turns of the joints, shape (m, n), and tilts of their bearings, shape (m, n, 2), under gravity [rad]."""
        turn, tilt = np.zeros_like(point.gravity), np.zeros_like(point.bearing_gravity)
        for j in self._drives:
            turn[:, j] = self._stretch(j, point.gravity[:, j])[0]
        for j, name, sign in self._gaps:
            turn[:, j] += sign * np.sign(point.gravity[:, j]) * self._values[name]
        for (j, axis), name in self._bearings.items():
            tilt[:, j, axis] = point.bearing_gravity[:, j, axis] / self._values[name]
        return turn, tilt

    def softness(self, point: ChainPoint) -> Array:
        """How far joints turn, then bearings tilt about x' and then y', per torque, shape (m, 3 n) [rad/(N m)]."""
        m, n = point.gravity.shape
        soft = np.zeros((m, 3 * n))
        for j in self._drives:
            soft[:, j] = self._stretch(j, point.gravity[:, j])[1]
        for (j, axis), name in self._bearings.items():
            soft[:, n * (1 + axis) + j] = 1.0 / self._values[name]
        return soft

    def columns(self, q: Array, point: ChainPoint, by_yield: Array) -> dict[str, Array]:
        """Derivative of the target by every value of these at a given gravity, by name, shape (m, 3).

        Args:
            q: angles of the motors, shape (m, n) [rad].
            point: the arm at rest.
            by_yield: derivative of the target by what joints and bearings give way, in the order of `softness`, shape
                (m, 3, 3 n), gravity's answer included.
        """
        found: dict[str, Array] = {}
        n = len(self._joints)
        for j, (cos, sin), sign, order in self._waves():
            phase = self._values.get(order, 1.0) * q[:, j]
            c, s = sign * np.cos(phase), sign * np.sin(phase)
            parts = {cos: c, sin: s}
            if order in self._values:
                parts[order] = q[:, j] * (self._values[sin] * c - self._values[cos] * s)
            found |= {name: by_yield[:, :, j] * part[:, None] for name, part in parts.items()}
        cubic = self._there(CUBIC)
        for j, name in self._drives.items():
            x, slope = self._stretch(j, point.gravity[:, j])
            found[name] = -by_yield[:, :, j] * (x * slope)[:, None]
            if j in cubic:
                found[cubic[j]] = -by_yield[:, :, j] * (x**3 * slope)[:, None]
        for j, name, sign in self._gaps:
            found[name] = sign * by_yield[:, :, j] * np.sign(point.gravity[:, j])[:, None]
        for (j, axis), name in self._bearings.items():
            tilt = point.bearing_gravity[:, j, axis] / self._values[name] / self._values[name]  # a trial may be huge
            found[name] = -by_yield[:, :, n * (1 + axis) + j] * tilt[:, None]
        return found

    def _waves(self) -> Iterator[tuple[int, tuple[str, str], float, str]]:
        """Joint, names of both amplitudes, sign in the angle of the joint, and name of the waves per turn."""
        for (cos, sin), sign, order in ((WAVES, -1.0, WAVES_ORDER), (RIPPLE[:2], 1.0, RIPPLE[2])):
            there = self._there(sin)
            for j, name in self._there(cos).items():
                yield j, (name, there[j]), sign, f"{self._joints[j]}.{order}"

    def _stretch(self, j: int, pull: Array) -> tuple[Array, Array]:
        """Deflection of a drive under torques, shape (m,) [rad], and its slope [rad/(N m)]."""
        k = self._values[self._drives[j]]
        hard = self._values.get(f"{self._joints[j]}.{CUBIC}", 0.0)
        x = pull / k
        for _ in range(ROOTS if hard else 0):
            x = x - (k * x + hard * x**3 - pull) / np.maximum(k + 3.0 * hard * x**2, 0.05 * k)
        return x, 1.0 / np.maximum(k + 3.0 * hard * x**2, 0.05 * k)

    def _there(self, part: str) -> dict[int, str]:
        """Joints that have a parameter, and its full name."""
        names = {j: f"{joint}.{part}" for j, joint in enumerate(self._joints)}
        return {j: name for j, name in names.items() if name in self._values}
