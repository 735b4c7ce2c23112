# SPDX-License-Identifier: BSD-3-Clause
"""What makes an arm at rest differ from a rigid one with perfect encoders, joint by joint.

    q_j = q_motor_j + c cos(q_motor_j) + s sin(q_motor_j) + e_j + x_j - sign(g_j) w_j,    k x + k3 x^3 = g
    beta = g_beta / k_beta

c and s are the eccentricity of an encoder, e is what the transmission does unseen, g the torque of gravity and
of a payload at the target, w the backlash as Neubauer et al. (2015, eq. 18) have it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.geometry.arm_chain import ChainPoint
from jointscope.robots.geometry.error_parameters import BACKLASH, BEARING, STIFFNESS, WAVES
from jointscope.robots.geometry.pose_effects import CUBIC, PAYLOAD

Array = NDArray[np.float64]
ROOTS = 12  # Newton steps to the deflection of a spring that hardens


class WhatGivesWay:
    """Drives, bearings, gaps and encoders of a chain at some values.

    Args:
        joints: of the chain.
        gravity: acceleration in the base frame, shape (3,) [m/s^2].
        values: of all parameters; those that are not there do not act.
    """

    def __init__(self, joints: Sequence[str], gravity: Array, values: Mapping[str, float]):
        self._joints, self._gravity, self._values = tuple(joints), gravity, values
        self._drives = self._there(STIFFNESS)
        self._gaps = self._there(BACKLASH)
        self._bearings = {(j, axis): name for axis, part in enumerate(BEARING) for j, name in self._there(part).items()}

    @property
    def some(self) -> bool:
        """Whether anything depends on the load."""
        return bool(self._drives or self._gaps or self._bearings)

    def waves(self, q: Array) -> Array:
        """What encoders are off at angles of shape (m, n) [rad]."""
        off = np.zeros_like(q)
        for part, wave in zip(WAVES, (np.cos, np.sin), strict=True):
            for j, name in self._there(part).items():
                off[:, j] += self._values[name] * wave(q[:, j])
        return off

    def deflections(self, point: ChainPoint) -> tuple[Array, Array]:
        """Turns of the joints, shape (m, n), and tilts of their bearings, shape (m, n, 2), under gravity [rad]."""
        pull, across = self._pull(point)
        turn, tilt = np.zeros_like(pull), np.zeros_like(across)
        for j in self._drives:
            turn[:, j] = self._stretch(j, pull[:, j])[0]
        for j, name in self._gaps.items():
            turn[:, j] -= np.sign(pull[:, j]) * self._values[name]
        for (j, axis), name in self._bearings.items():
            tilt[:, j, axis] = across[:, j, axis] / self._values[name]
        return turn, tilt

    def columns(self, q: Array, point: ChainPoint) -> dict[str, Array]:
        """Derivative of the target by every value of these, by name, shape (m, 3); gravity is taken as it is."""
        pull, across = self._pull(point)
        found: dict[str, Array] = {}
        for part, wave in zip(WAVES, (np.cos, np.sin), strict=True):
            for j, name in self._there(part).items():
                found[name] = point.by_joint[:, :, j] * wave(q[:, j])[:, None]
        cubic, payload = self._there(CUBIC), np.zeros_like(point.target)
        by_mass, across_by_mass = self._by_payload(point)
        for j, name in self._drives.items():
            x, slope = self._stretch(j, pull[:, j])
            found[name] = -point.by_joint[:, :, j] * (x * slope)[:, None]
            if j in cubic:
                found[cubic[j]] = -point.by_joint[:, :, j] * (x**3 * slope)[:, None]
            payload += point.by_joint[:, :, j] * (by_mass[:, j] * slope)[:, None]
        for j, name in self._gaps.items():
            found[name] = -point.by_joint[:, :, j] * np.sign(pull[:, j])[:, None]
        for (j, axis), name in self._bearings.items():
            k = self._values[name]
            found[name] = -point.by_bearing[:, :, j, axis] * (across[:, j, axis] / k**2)[:, None]
            payload += point.by_bearing[:, :, j, axis] * (across_by_mass[:, j, axis] / k)[:, None]
        if PAYLOAD in self._values:
            found[PAYLOAD] = payload
        return found

    def _pull(self, point: ChainPoint) -> tuple[Array, Array]:
        """Torques about joints and bearings, those of a payload included [N m]."""
        mass = self._values.get(PAYLOAD, 0.0)
        if not mass:
            return point.gravity, point.bearing_gravity
        by_mass, across = self._by_payload(point)
        return point.gravity + mass * by_mass, point.bearing_gravity + mass * across

    def _by_payload(self, point: ChainPoint) -> tuple[Array, Array]:
        """The same per kilogram at the target [m^2/s^2]."""
        across = np.einsum("mkjb,k->mjb", point.by_bearing, self._gravity)
        return np.einsum("mkj,k->mj", point.by_joint, self._gravity), across

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
