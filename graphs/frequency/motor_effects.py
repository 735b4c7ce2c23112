# SPDX-License-Identifier: BSD-3-Clause
"""What drives and motors do that is not linear, as the motion that was measured makes them do it.

A wave of a gear and a spring that hardens are an offset u between motor and link, whose torque then is that of the
spring turned by it; a wave also levers the torque that is passed on. One of an encoder (o = 1) moves the rotor, too:
a scale of the angle of 1 + 1e-4, which is as large as sigmas of drives. Friction laws are torques p of the motor:

    u = c cos(o q) + s sin(o q),    -k3 d^3 / (k + j w d)
    p = pull u'(q),      J u'' + f u',      T e^(-(v / v_s)^2) tanh(k v),      c |pull| tanh(k v)

with d = q_link - q_motor and pull what the drive takes from the motor. All are taken in time and linear in their
parameter, along the motion of the stage before; measured torques that are late or scaled are linear at every line.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.robots.files.frequency_section import VISCOUS
from jointscope.robots.geometry.error_parameters import (
    CUBIC,
    LOAD_FRICTION,
    RIPPLE,
    STRIBECK,
    TORQUE_DELAY,
    TORQUE_SHARE,
    WAVES,
)
from jointscope.robots.geometry.flexible_arm import FlexibleArm

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
FINER = 8  # samples by the lines of the motion: what turns over within a swing has many of them
BREAKAWAY = 0.02  # [rad/s] v_s, which a swing of some degrees per second passes through at every turn


@dataclass(frozen=True)
class MotorEffects:
    """What effects of unit size do to the motors of a pose, by the name of their parameter.

    Attributes:
        offsets: motor, and turns that its drive is off by, in every experiment as it was, shape (b, K) [rad].
        torques: motor, and torques that it needs beside, shape (b, K) [N m].
    """

    offsets: Mapping[str, tuple[int, Complex]]
    torques: Mapping[str, tuple[int, Complex]]

    def offset(self, values: Mapping[str, float], shape: tuple[int, ...]) -> Complex:
        """Sum of all offsets at some sizes, shape (b, K, nu) [rad]."""
        return _summed(self.offsets, values, shape)

    def torque(self, values: Mapping[str, float], shape: tuple[int, ...]) -> Complex:
        """Sum of all torques at some sizes, shape (b, K, nu) [N m]."""
        return _summed(self.torques, values, shape)


def motor_effects(
    arm: FlexibleArm, pose: ShakenPose, values: Mapping[str, float], sharpness: Array, x: Complex
) -> MotorEffects:
    """The effects that `values` name.

    Args:
        arm: its springs.
        pose: the motion of the motors.
        values: of all parameters by name.
        sharpness: of the dry friction of each motor, shape (nu,) [s/rad].
        x: motion of the arm behind its springs, shape (b, K, n) [rad].
    """
    offsets: dict[str, tuple[int, Complex]] = {}
    torques: dict[str, tuple[int, Complex]] = {}
    for i, joint in enumerate(arm.joints):
        laws = list(_laws(joint, values))
        if not laws:
            continue
        motion, s = _Motion.of(arm, pose, values, x, i, sharpness[i]), _rates(pose, pose.motions.shape[1])
        own = {f"{joint}.{part}": wave for part in laws if (wave := motion.offset(part, joint, values)) is not None}
        motion = motion.passing(sum(values[name] * wave for name, wave in own.items()))
        beside = {f"{joint}.{part}": p for part in laws if (p := motion.torque(part, joint, values)) is not None}
        rotor = s * s * values[f"{joint}.inertia"] + s * values.get(f"{joint}.{VISCOUS}", 0.0)
        beside |= {f"{joint}.{part}": rotor * own[f"{joint}.{part}"] for part in WAVES if part in laws}
        offsets |= {name: (i, wave) for name, wave in own.items()}
        torques |= {name: (i, wave) for name, wave in beside.items()}
    return MotorEffects(offsets, torques)


def stiffer_drives(arm: FlexibleArm, pose: ShakenPose, values: Mapping[str, float], x: Complex | None) -> Array | None:
    """What drives that harden are stiffer by on average, 3 k3 <d^2>, shape (nu,) [N m/rad]; None where none does."""
    k3 = np.array([values.get(f"{joint}.{CUBIC}", 0.0) for joint in arm.joints])
    if x is None or not np.any(k3 > 0.0):
        return None
    power = np.abs(x[:, :, arm.driven] - pose.motions) ** 2
    square = np.mean(power[:, 0] + 2.0 * power[:, 1:].sum(axis=1), axis=0)
    return np.asarray(3.0 * np.maximum(k3, 0.0) * square)


def measured_torques(
    joints: tuple[str, ...], tau: Complex, w: Array, values: Mapping[str, float]
) -> tuple[Complex, dict[str, Complex]]:
    """Torques of the motors from those that were measured, and derivatives of what the balance lacks by name.

    Args:
        joints: whose motors they are.
        tau: measured, shape (e, l, nu) [N m].
        w: of the lines, shape (l,) [rad/s].
        values: of all parameters by name.
    """
    early = np.exp(1j * w * values.get(TORQUE_DELAY, 0.0))[:, None]
    shares = np.array([values.get(f"{joint}.{TORQUE_SHARE}", 0.0) for joint in joints])
    true = (1.0 + shares) * early * tau
    columns = {
        f"{joint}.{TORQUE_SHARE}": -early * tau * own for joint, own in zip(joints, np.eye(len(joints)), strict=True)
    }
    columns[TORQUE_DELAY] = -1j * w[:, None] * true
    return true, {name: column for name, column in columns.items() if name in values}


def _laws(joint: str, values: Mapping[str, float]) -> Iterator[str]:
    for part in (*WAVES, *RIPPLE[:2], CUBIC, STRIBECK, LOAD_FRICTION):
        if f"{joint}.{part}" in values:
            yield part


def _rates(pose: ShakenPose, count: int) -> Complex:
    """J w of the first lines, shape (count,) [rad/s]."""
    return np.asarray(2j * np.pi * pose.found.excitation.f0 * np.arange(count))


@dataclass(frozen=True)
class _Motion:
    """A motor and its drive in time, shape (b, N) each; deflection, shape (b, K), and spring, shape (K,), by lines."""

    q: Array
    v: Array
    pull: Array
    d: Complex
    spring: Complex
    sharpness: float

    @staticmethod
    def of(
        arm: FlexibleArm, pose: ShakenPose, values: Mapping[str, float], x: Complex, i: int, sharpness: float
    ) -> _Motion:
        m, fast = pose.motions[:, :, i], pose.whole_motions[:, :, i]
        count = next_fast_len(FINER * fast.shape[1], real=True)
        w = np.asarray(_rates(pose, m.shape[1]).imag, dtype=np.float64)
        q, v = (np.fft.irfft(X * count, count, axis=1) for X in (m, _rates(pose, fast.shape[1]) * fast))
        kappa = arm.dynamic(w, values)[:, arm.driven[i]]
        return _Motion(q, v, np.zeros_like(q), x[:, :, arm.driven[i]] - m, kappa, sharpness)

    def passing(self, offset: Complex | float) -> _Motion:
        """With what the drive takes from the motor when it is off by some turns."""
        return replace(self, pull=self._in_time(-self.spring * (self.d - offset)))

    def offset(self, part: str, joint: str, values: Mapping[str, float]) -> Complex | None:
        """By which an effect of unit size turns the drive, shape (b, K) [rad]."""
        if part == CUBIC:
            return -self._lines(self._in_time(self.d) ** 3) / self.spring  # the damper has no part in its torque
        return self._lines(self._wave(part, joint, values)[0]) if part in (*WAVES, *RIPPLE[:2]) else None

    def torque(self, part: str, joint: str, values: Mapping[str, float]) -> Complex | None:
        """That the motor needs for an effect of unit size, shape (b, K) [N m]."""
        turn = np.tanh(self.sharpness * self.v)
        if part == STRIBECK:
            return self._lines(np.exp(-((self.v / BREAKAWAY) ** 2)) * turn)
        if part == LOAD_FRICTION:
            return self._lines(np.abs(self.pull) * turn)
        return self._lines(self.pull * self._wave(part, joint, values)[1]) if part in RIPPLE[:2] else None

    def _wave(self, part: str, joint: str, values: Mapping[str, float]) -> tuple[Array, Array]:
        """A wave of the gear or of the encoder, and its slope."""
        order = 1.0 if part in WAVES else values[f"{joint}.{RIPPLE[2]}"]
        c, s = np.cos(order * self.q), np.sin(order * self.q)
        return (c, -order * s) if part in (WAVES[0], RIPPLE[0]) else (s, order * c)

    def _in_time(self, lines: Complex) -> Array:
        return np.asarray(np.fft.irfft(lines * self.q.shape[1], self.q.shape[1], axis=1))

    def _lines(self, wave: Array) -> Complex:
        return np.asarray(np.fft.rfft(wave, axis=1)[:, : len(self.spring)] / wave.shape[1])


def _summed(parts: Mapping[str, tuple[int, Complex]], values: Mapping[str, float], shape: tuple[int, ...]) -> Complex:
    total = np.zeros(shape, dtype=complex)
    for name, (motor, wave) in parts.items():
        total[:, :, motor] += values[name] * wave
    return total
