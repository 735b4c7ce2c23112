# SPDX-License-Identifier: BSD-3-Clause
"""Shaken drives that rattle in a gap: they pass on nothing for longer than a drive that only swings through zero.

What a drive passes on is known from its motor alone, whatever the arm behind it does:

    T = tau - J q'' - f q' - mu tanh(k q')

Under many sines its density is smooth, and about zero hardly above that at a distance s on both sides: exp(0.32) = 1.4
times for a Gaussian about zero of sigma s / 0.8, less for one about another mean. A drive in its gap has T = 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.robots.files.sections.frequency_section import COULOMB, INERTIA
from jointscope.robots.geometry.error_parameters import VISCOUS

Array = NDArray[np.float64]
NEAR, BESIDE = 0.2, (0.6, 1.0)  # of the standard deviation of T: about zero, and on both sides of it
RATTLES = 2.0  # times the density beside
SEEN = 0.02  # share of the time beside zero, at least: else the drive does not swing through it


@dataclass(frozen=True)
class Dwelling:
    """How long a drive passes on nothing.

    Attributes:
        joint: of the drive.
        share: of the time in which what it passes on is about zero.
        smooth: the share that its density beside zero lets expect.
    """

    joint: str
    share: float
    smooth: float

    @property
    def rattles(self) -> bool:
        """Whether it dwells in a gap."""
        return self.share > RATTLES * self.smooth > 0.0

    def __str__(self) -> str:
        return (
            f"the drive of {self.joint} passes on nothing for {100.0 * self.share:.0f} % of the time, "
            f"{100.0 * self.smooth:.0f} % would be smooth: it rattles in a gap, backlash@{self.joint}"
        )


def dwellings(pose: ShakenPose, joints: Sequence[str], values: Mapping[str, float], sharpness: Array) -> list[Dwelling]:
    """Each drive of a pose that swings through zero.

    Args:
        pose: torques and motions of the motors.
        joints: whose motors they are.
        values: of inertias and friction by name.
        sharpness: of the dry friction of each motor, shape (nu,) [s/rad].
    """
    T = _passed(pose, joints, values, sharpness)
    size = np.abs(T) / T.std(axis=0)
    near, beside = np.mean(size < NEAR, axis=0), np.mean((size > BESIDE[0]) & (size < BESIDE[1]), axis=0)
    smooth = beside * NEAR / (BESIDE[1] - BESIDE[0])
    each = zip(joints, near.tolist(), smooth.tolist(), beside.tolist(), strict=True)
    return [Dwelling(joint, share, expected) for joint, share, expected, seen in each if seen > SEEN]


def _passed(pose: ShakenPose, joints: Sequence[str], values: Mapping[str, float], sharpness: Array) -> Array:
    """What drives take from their motors at all times of all experiments, shape (n, nu) [N m]."""
    m, fast = pose.motions, pose.whole_motions
    K, count = m.shape[1], 2 * fast.shape[1]
    s = 2j * np.pi * pose.found.excitation.f0 * np.arange(fast.shape[1])[:, None]
    v = np.fft.irfft(s * fast * count, count, axis=1)
    dry = np.fft.rfft(np.tanh(sharpness * v), axis=1)[:, :K] / count
    J, mu, f = (
        np.array([values.get(f"{joint}.{part}", 0.0) for joint in joints]) for part in (INERTIA, COULOMB, VISCOUS)
    )
    lines = pose.whole_torques[:, :K] - (J * s[:K] ** 2 + f * s[:K]) * m - mu * dry
    return np.asarray(np.fft.irfft(lines * count, count, axis=1).reshape(-1, len(joints)))
