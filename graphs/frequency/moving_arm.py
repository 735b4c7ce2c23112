# SPDX-License-Identifier: BSD-3-Clause
"""What torque the motors of a flexible arm need for a periodic motion that is as large as it is.

    rnea(x, x', x'') + D x' + K x = E (d m' + k m),    tau = k (m - x) + d (m' - x') + J m''

m is the motion of the motors as it was measured, with the offsets of their drives where these have some, x that of the
arm behind its springs, E picks the drives from x.
Inertias change with the motion: with the part that carries the excitation, whose lines answer lines beside them, and
with the excitation itself. The rigid body is taken in time, springs and dampers line by line, and x is found in steps

    x <- x - A^-1 r

with A the arm linearised about the motion that carries the excitation, a band of blocks (Wereley, 1990).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len
from scipy.linalg import solve_banded

from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.robots.geometry.flexible_arm import FlexibleArm, Linearised

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
HARMONICS = 2  # of the arm about the motion that carries the excitation
FINER = 3  # samples by the lines of the motion: products of two lines fold onto none of them
MOST_ROUNDS = 8
BALANCED = 1e-6  # of what the links need, rms, that may be left


@dataclass(frozen=True)
class MovingArm:
    """The arm in all experiments of a pose.

    Attributes:
        torques: of springs and rotors, both signs of the excitation subtracted, shape (e, K, nu) [N m].
        x: of the arm, every experiment as it was, shape (b, K, n) [rad].
        left: what the links need and do not get over what they need, rms, round by round.
    """

    torques: Complex
    x: Complex
    left: tuple[float, ...]


def moving_arm(
    arm: FlexibleArm,
    pose: ShakenPose,
    values: Mapping[str, float],
    begin: Complex | None = None,
    offset: Complex | float = 0.0,
    stiffer: Array | None = None,
) -> MovingArm:
    """The arm of a pose under the motion that was measured.

    Args:
        arm: its springs.
        pose: the motion.
        values: of all parameters by name.
        begin: the arm's motion at values nearby, shape (b, K, n) [rad]; None for that of the motors.
        offset: of the drives, shape (b, K, nu) [rad].
        stiffer: what drives that harden are stiffer by about `begin`, for which their offset was found, shape (nu,)
            [N m/rad].
    """
    K, f0 = pose.motion.shape[1], pose.found.excitation.f0
    w = np.asarray(2.0 * np.pi * f0 * np.arange(K), dtype=np.float64)
    s = 1j * w[:, None]
    kappa = arm.dynamic(w, values)
    own, driven = kappa[:, arm.driven], arm.driven
    m = pose.motions
    turned = m + offset
    if begin is not None and stiffer is not None:  # the same torque there, and its slope
        turned = begin[:, :, driven] + (turned - begin[:, :, driven]) * own / (own + stiffer)
        kappa[:, driven] += stiffer
        own = kappa[:, driven]
    pull = np.zeros((*m.shape[:2], kappa.shape[1]), dtype=complex)
    pull[:, :, driven] = own * turned
    x = np.zeros_like(pull)
    x[:, :, driven] = m
    x = x if begin is None else begin
    about = arm.linearised(pose.q, values, pose.carrier, 2.0 * np.pi * pose.found.excitation.carrier, _harmonics(pose))
    equations, count = arm.equations(pose.q, values), next_fast_len(FINER * K, real=True)

    def balance(x: Complex) -> tuple[Complex, float]:
        motion = (np.fft.irfft(part * count, count, axis=1).reshape(-1, x.shape[2]) for part in (x, s * x, s * s * x))
        torques = equations.torque(*motion).reshape(len(x), count, -1)
        links = np.fft.rfft(torques, axis=1)[:, :K] / count
        r = links + kappa * x - pull
        return r, float(np.linalg.norm(r[:, 1:]) / np.linalg.norm(links[:, 1:]))

    r, size = balance(x)
    left = [size]
    while left[-1] > BALANCED and len(left) < MOST_ROUNDS:
        nearer = x - _solved(about, w, kappa, r, max(pose.step, 1))
        r, size = balance(nearer)
        if size >= left[-1]:
            break
        x = nearer
        left.append(size)
    inertias = np.array([values[f"{joint}.inertia"] for joint in arm.joints])
    torques = own * (turned - x[:, :, driven]) - (w**2)[:, None] * inertias * m
    return MovingArm(pose.both_signs(torques), x, tuple(left))


def _harmonics(pose: ShakenPose) -> int:
    return HARMONICS if pose.step else 0


def _solved(about: Linearised, w: Array, kappa: Complex, r: Complex, step: int) -> Complex:
    """A^-1 r; lines that are `step` apart answer each other."""
    x = np.empty_like(r)
    for first in range(step):
        lines = np.arange(first, r.shape[1], step)
        band, width = _band(about, w[lines], kappa[lines])
        right = np.moveaxis(r[:, lines], 0, 2).reshape(-1, len(r))
        solved = solve_banded((width, width), band, right, overwrite_ab=True, overwrite_b=True)
        x[:, lines] = np.moveaxis(solved.reshape(len(lines), -1, len(r)), 2, 0)
    return x


def _band(about: Linearised, w: Array, kappa: Complex) -> tuple[Complex, int]:
    """Blocks of neighbouring lines as LAPACK's band, and its width."""
    harmonics, n, count = len(about.M) // 2, about.M.shape[1], len(w)
    width = n * harmonics + n - 1
    band = np.zeros((2 * width + 1, n * count), dtype=complex)
    i, j = np.divmod(np.arange(n * n), n)
    for h in range(-harmonics, harmonics + 1):
        columns = np.arange(max(0, -h), min(count, count - h))  # line `columns` drives line `columns + h`
        at = w[columns][:, None, None]
        block = -(at**2) * about.M[h + harmonics] + 1j * at * about.C[h + harmonics] + about.G[h + harmonics]
        if h == 0:
            block = block + kappa[:, :, None] * np.eye(n)
        row, column = n * (columns + h)[:, None] + i, n * columns[:, None] + j
        band[width + row - column, column] = block.reshape(len(columns), -1)
    return band, width
