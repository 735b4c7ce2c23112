# SPDX-License-Identifier: BSD-3-Clause
"""What drives and motors do that is not linear, as the motion that was measured makes them do it.

A wave of a gear and a spring that hardens are an offset u between motor and link, whose torque then is that of the
spring turned by it; a wave also levers the torque that is passed on. One of an encoder (o = 1 unless a parameter says
otherwise) is what the reading has too much, so that c and s have the other sign, and moves the rotor, too: a scale of
the angle of 1 + 1e-4, which is as large as sigmas of drives. Friction laws are torques p of the motor:

    u = c cos(o q) + s sin(o q),    -k3 d^3 / (k + j w d)
    p = pull u'(q),      J u'' + f u',      T e^(-(v / v_s)^2) tanh(k v),      c |pull| tanh(k v)

with d = q_link - q_motor and pull what the drive takes from the motor. All are taken in time and linear in their
parameter, along the motion of the stage before; measured torques that are late or scaled are linear at every line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.robots.geometry.error_parameters import (
    CUBIC,
    LOAD_FRICTION,
    RIPPLE,
    STRIBECK,
    TORQUE_DELAY,
    TORQUE_SHARE,
    VISCOUS,
    WAVES,
    WAVES_ORDER,
)
from jointscope.robots.geometry.flexible_arm import FlexibleArm

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
FINER = 8  # samples by the lines of the motion: what turns over within a swing has many of them
DRY = (STRIBECK, LOAD_FRICTION)
LAWS = (*WAVES, *RIPPLE[:2], CUBIC, *DRY)
BREAKAWAY = 0.02  # [rad/s] v_s, which a swing of some degrees per second passes through at every turn


@dataclass(frozen=True)
class MotorEffects:
    """What effects do to the motors of a pose in every experiment as it was.

    Attributes:
        waves: by parameter the motor, and derivatives of its drive's offset [rad] and of its torque [N m], shape (b, K)
            each; None where there is none.
        offset: of all effects at their sizes, shape (b, K, nu) [rad].
        torque: of all effects at their sizes, shape (b, K, nu) [N m].
        sharper: its derivative by the logarithm of how sharply friction turns over, shape (b, K, nu) [N m].
        stiffer: what drives that harden are stiffer by on average, 3 k3 <d^2>, shape (nu,) [N m/rad].
    """

    waves: Mapping[str, tuple[int, Complex | None, Complex | None]]
    offset: Complex
    torque: Complex
    sharper: Complex
    stiffer: Array


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
    waves: dict[str, tuple[int, Complex | None, Complex | None]] = {}
    offset, torque, sharper = (np.zeros(pose.motions.shape, dtype=complex) for _ in range(3))
    stiffer = np.zeros(len(arm.joints))
    for i, joint in enumerate(arm.joints):
        laws = {part: values[f"{joint}.{part}"] for part in LAWS if f"{joint}.{part}" in values}
        if not laws:
            continue
        motion = _Motion.of(arm, pose, values, x, i, sharpness[i])
        order, of_disk = values.get(f"{joint}.{RIPPLE[2]}", 0.0), values.get(f"{joint}.{WAVES_ORDER}", 1.0)
        own = {part: motion.offset(part, of_disk if part in WAVES else order) for part in laws}
        offset[:, :, i] = _summed(laws, own)
        motion = motion.passing(offset[:, :, i])
        beside = {part: motion.torque(part, order) for part in laws}
        s = _rates(pose, pose.motions.shape[1])
        rotor = s * s * values[f"{joint}.inertia"] + s * values.get(f"{joint}.{VISCOUS}", 0.0)
        beside |= {part: rotor * wave for part, wave in own.items() if part in WAVES and wave is not None}
        torque[:, :, i] = _summed(laws, beside)
        turning = motion.sharper()
        sharper[:, :, i] = _summed(laws, {part: turning.torque(part, order) for part in DRY if part in laws})
        stiffer[i] = 3.0 * max(laws.get(CUBIC, 0.0), 0.0) * motion.square
        waves |= {f"{joint}.{part}": (i, own[part], beside[part]) for part in laws}
        if order:
            cos, sin = (laws.get(part, 0.0) for part in RIPPLE[:2])
            waves[f"{joint}.{RIPPLE[2]}"] = i, *motion.by_order(order, cos, sin)
        if f"{joint}.{WAVES_ORDER}" in values:
            turned = -motion.by_order(of_disk, *(laws.get(part, 0.0) for part in WAVES))[0]
            waves[f"{joint}.{WAVES_ORDER}"] = i, turned, rotor * turned
    return MotorEffects(waves, offset, torque, sharper, stiffer)


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


def _summed(sizes: Mapping[str, float], waves: Mapping[str, Complex | None]) -> Complex | float:
    """Sum of waves at some sizes, shape (b, K)."""
    return sum((sizes[part] * wave for part, wave in waves.items() if wave is not None), 0.0)


def _rates(pose: ShakenPose, count: int) -> Complex:
    """J w of the first lines, shape (count,) [rad/s]."""
    return np.asarray(2j * np.pi * pose.found.excitation.f0 * np.arange(count))


@dataclass(frozen=True)
class _Motion:
    """A motor and its drive in time, shape (b, N) each; deflection, shape (b, K), and spring, shape (K,), by lines.

    `sharp` is k v, `turn` its tanh.
    """

    q: Array
    v: Array
    sharp: Array
    turn: Array
    pull: Array
    d: Complex
    spring: Complex

    @staticmethod
    def of(
        arm: FlexibleArm, pose: ShakenPose, values: Mapping[str, float], x: Complex, i: int, sharpness: float
    ) -> _Motion:
        m, fast = pose.motions[:, :, i], pose.whole_motions[:, :, i]
        count = next_fast_len(FINER * fast.shape[1], real=True)
        w = np.asarray(_rates(pose, m.shape[1]).imag, dtype=np.float64)
        q, v = (np.fft.irfft(X * count, count, axis=1) for X in (m, _rates(pose, fast.shape[1]) * fast))
        kappa = arm.dynamic(w, values)[:, arm.driven[i]]
        return _Motion(q, v, sharpness * v, np.tanh(sharpness * v), np.zeros_like(q), x[:, :, arm.driven[i]] - m, kappa)

    def passing(self, offset: Complex | float) -> _Motion:
        """With what the drive takes from the motor when it is off by some turns."""
        return replace(self, pull=self._in_time(-self.spring * (self.d - offset)))

    def sharper(self) -> _Motion:
        """With the derivative of what turns over by the logarithm of its sharpness in its place."""
        return replace(self, turn=self.sharp * (1.0 - self.turn**2))

    @property
    def square(self) -> float:
        """Mean square of the deflection [rad^2]."""
        return float(np.mean(self._in_time(self.d) ** 2))

    def offset(self, part: str, order: float) -> Complex | None:
        """By which an effect of unit size turns the drive, shape (b, K) [rad]."""
        if part == CUBIC:
            return -self._lines(self._in_time(self.d) ** 3) / self.spring  # the damper has no part in its torque
        if part in WAVES:
            return -self._lines(self._wave(part, order)[0])
        return self._lines(self._wave(part, order)[0]) if part in RIPPLE[:2] else None

    def torque(self, part: str, order: float) -> Complex | None:
        """That the motor needs for an effect of unit size, shape (b, K) [N m]."""
        if part == STRIBECK:
            return self._lines(np.exp(-((self.v / BREAKAWAY) ** 2)) * self.turn)
        if part == LOAD_FRICTION:
            return self._lines(np.abs(self.pull) * self.turn)
        return self._lines(self.pull * self._wave(part, order)[1]) if part in RIPPLE[:2] else None

    def by_order(self, order: float, cos: float, sin: float) -> tuple[Complex, Complex]:
        """Derivatives of offset and torque of a wave by its waves per turn, shape (b, K) each."""
        (c, c_slope), (s, s_slope) = (self._wave(part, order) for part in RIPPLE[:2])
        u, slope = cos * c + sin * s, (cos * c_slope + sin * s_slope) / order
        return self._lines(self.q * slope), self._lines(self.pull * (slope - order * self.q * u))

    def _wave(self, part: str, order: float) -> tuple[Array, Array]:
        """A wave of the gear, or of the encoder, and its slope."""
        c, s = np.cos(order * self.q), np.sin(order * self.q)
        return (c, -order * s) if part in (WAVES[0], RIPPLE[0]) else (s, order * c)

    def _in_time(self, lines: Complex) -> Array:
        return np.asarray(np.fft.irfft(lines * self.q.shape[1], self.q.shape[1], axis=1))

    def _lines(self, wave: Array) -> Complex:
        return np.asarray(np.fft.rfft(wave, axis=1)[:, : len(self.spring)] / wave.shape[1])
