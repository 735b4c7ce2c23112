# SPDX-License-Identifier: BSD-3-Clause
"""Start values of the drives and the signs of their commands, by regression on the recorded motion.

With rigid joints  M a + c + g = k u - k_mi v - mu sign(v) - b a  is linear in what is wanted. All signals pass the same
band-pass, so noise and slow drift stay out. Only a start: the calibration finds the values.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.signal import butter, savgol_filter, sosfiltfilt

from jointscope.robots.recording import Stream
from jointscope.robots.rigid_tree import RigidTree

Array = NDArray[np.float64]

BAND = (0.3, 8.0)  # [Hz]
SAMPLES_PER_PERIOD = 6.0  # of the fastest motion that is used
OPPOSITE = 10.0  # [sigma] from which a motor turns against its command
SMALLEST = 0.02  # of the rms torque that a term explains at least: a start value must be above zero
MATCHED = 0.3  # of the link's inertia that a motor behind a gear has at least; springs hide it from this regression
SHARPNESS = 200.0  # [s/rad]


@dataclass(frozen=True)
class DriveValues:
    """One joint's drive, on the link side.

    Attributes:
        k: torque per unit of the command [N m/V] or [1].
        k_mi: torque per speed [N m s/rad].
        coulomb: dry friction [N m].
        inertia: of the motor [kg m2].
        sign: -1 where the command turns the joint backwards.
        confidence: how far the sign is from the other one [sigma].
        link: inertia of everything behind the joint at the first posture [kg m2]; 1 where masses are not known.
    """

    k: float
    k_mi: float
    coulomb: float
    inertia: float
    sign: float
    confidence: float
    link: float = 1.0


def drive_values(
    tree: RigidTree, encoder: Stream, command: Stream, per_unit: float, torque: Stream | None, masses: bool
) -> list[DriveValues]:
    """Drives of all joints.

    Args:
        tree: the robot; its masses are used only if `masses`.
        encoder: positions of the motors [rad].
        command: what drives them.
        per_unit: volts per unit of the command; 1 for torques.
        torque: measured behind the motors, used where there are no masses.
        masses: whether the URDF has them.
    """
    h = float(np.median(np.diff(encoder.times)))
    times = np.arange(encoder.times[0], encoder.times[-1], h)
    q = np.column_stack([np.interp(times, encoder.times, column) for column in encoder.values.T])
    index = np.clip(np.searchsorted(command.times, times, side="right") - 1, 0, len(command.times) - 1)
    u = per_unit * command.values[index]
    width = min(2 * max(round(0.03 / h / 2.0), 2) + 1, len(times) - 1 + len(times) % 2)
    v, a = (savgol_filter(q, width, 3, deriv=order, delta=h, axis=0) for order in (1, 2))
    if torque is not None and not masses:
        load = np.column_stack([np.interp(times, torque.times, column) for column in torque.values.T])
    else:
        load = tree.torque(q, v, a) if masses else np.zeros_like(q)
    inertias = np.diagonal(tree.mass_matrix(q[:1])[0]) if masses else np.ones(q.shape[1])
    high = min(BAND[1], 1.0 / (SAMPLES_PER_PERIOD * h))
    band = butter(2, [BAND[0], high], btype="band", fs=1.0 / h, output="sos")
    # a band-passed signal is known from two samples per period of its bandwidth
    count = 2.0 * (high - BAND[0]) * float(times[-1] - times[0])
    filtered = [sosfiltfilt(band, part, axis=0) for part in (load, u, -v, -np.tanh(SHARPNESS * v), -a)]
    joints = range(q.shape[1])
    return [
        _joint(*(p[:, j] for p in filtered), count=count, inertia=float(inertias[j]), masses=masses) for j in joints
    ]


def _joint(
    load: Array,
    u: Array,
    minus_v: Array,
    minus_sign: Array,
    minus_a: Array,
    *,
    count: float,
    inertia: float,
    masses: bool,
) -> DriveValues:
    sign, confidence = _sign(load if np.any(load) else -minus_a, u, minus_v, minus_sign, count)
    if not masses:
        # without masses only ratios are known: everything per unit of torque
        return DriveValues(1.0, 1.0, 1.0, 1.0, sign, confidence)
    X = np.column_stack([sign * u, minus_v, minus_sign, minus_a])
    size = np.sqrt(np.mean(X**2, axis=0))
    torque = float(np.sqrt(np.mean(load**2)))
    X, scale = X[:, size > 0], size[size > 0]
    values = np.zeros(4)
    values[size > 0] = nnls(X / scale, load)[0] / scale
    least = SMALLEST * torque / np.where(size > 0, size, np.inf)
    k, k_mi, coulomb, b = np.maximum(values, least)
    k = float(k) if values[0] > 0 else torque / float(size[0] or 1.0)
    return DriveValues(k, float(k_mi), float(coulomb), max(float(b), MATCHED * inertia), sign, confidence, inertia)


def _sign(load: Array, u: Array, minus_v: Array, minus_sign: Array, count: float) -> tuple[float, float]:
    """Sign of the command against the joint, and its distance from the other one in sigmas.

    The command is regressed on load, speed and direction, all of which it drives in its own direction.
    """
    X = np.column_stack([load, -minus_v, -minus_sign])
    size = np.sqrt(np.mean(X**2, axis=0))
    if np.any(size == 0.0) or not np.any(u):
        return 1.0, 0.0
    X = X / size
    values, _, rank, _ = np.linalg.lstsq(X, u, rcond=None)
    if rank < X.shape[1]:
        return 1.0, 0.0
    rest = u - X @ values
    covariance = np.linalg.inv(X.T @ X) * len(u) / max(count, 4.0) * float(np.mean(rest**2))
    pull, sigma = float(values.sum()), float(np.sqrt(np.sum(covariance)))
    confidence = abs(pull) / max(sigma, 1e-300)
    return (-1.0 if pull < 0 and confidence > OPPOSITE else 1.0), confidence
