# SPDX-License-Identifier: BSD-3-Clause
"""Compares every gyroscope with the rate that the encoders imply for its body.

Wrong units, swapped or flipped axes show, and whether an IMU has an accelerometer at all.

A flexible joint makes the two differ by some tens of percent; a wrong unit by a factor of 57 or 10.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import AXES, RIGHT_FROM_LEFT, Gyro
from jointscope.robots.recordings.joint_motion import JointMotion, window_mean
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.robots.units import UNITS, si_factor, si_unit

Array = NDArray[np.float64]

ENOUGH_RATE = 0.05  # [rad/s] rms; below, noise decides
SAME_RATE = 5.0  # ratios up to this are flexibility, not units
UNIT_TOLERANCE = 2.4  # a unit explains a ratio that it meets within this factor
CLEARLY_WORSE = float(np.log(1.3))  # by which another unit explains a ratio worse, to be left unsaid
SAME_MOTION = 0.5  # correlation of the two rates' norms
MIRRORED = "mirrored"  # kind of the notice of axes of the other hand, which no mounting can turn right
BAD_FIT, BETTER = 0.6, 0.35  # the expected axes leave more than that share of the gyro's power, others that much less
ODD_FIT, MUCH_BETTER = 0.2, 0.1  # where they leave less, others must be clearly better
ENOUGH_INSTANTS = 10
DEGREES = 180.0 / np.pi


def check_accelerometers(recording: Recording, robot: Robot) -> None:
    """Checks that all accelerometers are there.

    Raises:
        RecordingError: an IMU without an accelerometer.
    """
    for sensor in robot.accelerometers:
        values = recording.streams[sensor.name].values
        if not np.any(values):
            raise RecordingError(
                f"{sensor.name} reads zero in all {len(values)} samples: the IMU on {sensor.source.topic} has no "
                f"accelerometer; remove sensors.{sensor.name} and its lever from the robot file"
            )


def check_gyros(recording: Recording, robot: Robot, motion: JointMotion) -> list[Notice]:
    """Checks all gyroscopes.

    Args:
        recording: the recording.
        robot: the robot.
        motion: motion of its joints.

    Returns:
        Notices about axes, and about rates that no unit explains.

    Raises:
        RecordingError: a gyroscope or the encoders are in another unit than the robot file says.
    """
    rates = {gyro.name: _rates(recording, robot, gyro, motion) for gyro in robot.gyros}
    ratios = {name: _rms(pair.measured) / _rms(pair.implied) for name, pair in rates.items() if pair is not None}
    encoders_confirmed = any(1.0 / SAME_RATE < ratio < SAME_RATE for ratio in ratios.values())
    notices = []
    for gyro in robot.gyros:
        pair = rates[gyro.name]
        if pair is None:
            continue
        if 1.0 / SAME_RATE < ratios[gyro.name] < SAME_RATE:
            notices += _check_axes(gyro, pair)
        else:
            notices += _check_unit(gyro, robot, pair, encoders_confirmed)
    return notices


@dataclass(frozen=True)
class RatePair:
    """Rates of one gyroscope without their means, in which the bias hides; both of shape (m, 3) [rad/s].

    Attributes:
        measured: by the gyroscope.
        implied: by the encoders, in the sensor frame that the robot file expects.
    """

    measured: Array
    implied: Array


def _rates(recording: Recording, robot: Robot, gyro: Gyro, motion: JointMotion) -> RatePair | None:
    """Both rates where both streams last; None where neither shows enough motion to judge."""
    stream = recording.streams[gyro.name]
    inside = (motion.times >= stream.times[0]) & (motion.times <= stream.times[-1])
    if np.count_nonzero(inside) < ENOUGH_INSTANTS:
        return None
    omega_body = robot.tree.body_rate(gyro.body, motion.q[inside], motion.v[inside])[0]
    implied = omega_body @ gyro.R_imu_body.T
    measured = window_mean(stream, motion.times[inside], motion.window)
    pair = RatePair(measured - measured.mean(axis=0), implied - implied.mean(axis=0))
    quiet = max(_rms(pair.measured), _rms(pair.implied)) < ENOUGH_RATE
    return None if quiet or _rms(pair.implied) == 0 else pair


def _check_unit(gyro: Gyro, robot: Robot, pair: RatePair, encoders_confirmed: bool) -> list[Notice]:
    ratio = _rms(pair.measured) / _rms(pair.implied)
    text = f"{gyro.name} turns {ratio:.3g} times as fast as the encoders say that {gyro.body} does"
    norms = np.linalg.norm(pair.measured, axis=1), np.linalg.norm(pair.implied, axis=1)
    together = bool(np.ptp(norms[0]) > 0 and np.ptp(norms[1]) > 0) and np.corrcoef(*norms)[0, 1] > SAME_MOTION
    encoder = robot.motor_encoder
    found = [
        (
            misfit,
            f"its values look like {unit}: set `unit` of sensors.{gyro.name} in the robot file (now "
            f"{gyro.source.unit}) to {unit}",
        )
        for unit, misfit in _units_that_explain(ratio, gyro.source.unit)
    ]
    if not encoders_confirmed:
        found += [
            (
                misfit,
                f"the encoders look like {unit}: set `unit` of sensors.{encoder.name} in the robot file "
                f"(now {encoder.source.unit}) to {unit}",
            )
            for unit, misfit in _units_that_explain(1.0 / ratio, encoder.source.unit)
        ]
    found.sort()
    fits = [text for misfit, text in found if misfit < found[0][0] + CLEARLY_WORSE]
    if not fits and abs(abs(np.log(ratio)) - np.log(DEGREES)) < np.log(UNIT_TOLERANCE):
        fits = ["that is the factor between degrees and radians: check what its driver publishes"]
    if together and fits:
        raise RecordingError(f"{text}; {', or '.join(fits)}")
    if _rms(pair.implied) < ENOUGH_RATE:
        return []
    return [Notice(gyro.name, "unit", 0, f"{text}; check its unit, its body and its topic")]


def _units_that_explain(ratio: float, declared: str) -> list[tuple[str, float]]:
    """The unit that a signal must have if it is `ratio` times too large when read as `declared`; none or one.

    With it stands how far off the ratio is, as a logarithm.
    """
    misfits = {
        unit: abs(float(np.log(ratio * si_factor(unit) / si_factor(declared))))
        for unit in UNITS
        if si_unit(unit) == si_unit(declared) and unit != declared
    }
    best = min(misfits, key=misfits.__getitem__)
    return [(best, misfits[best])] if misfits[best] < np.log(UNIT_TOLERANCE) else []


def _check_axes(gyro: Gyro, pair: RatePair) -> list[Notice]:
    """Looks for the signed permutation of the axes that fits best, if the expected one does not fit."""
    power = float(np.sum(pair.measured**2))
    left = {axes: float(np.sum((pair.measured - pair.implied @ axes_matrix(axes).T) ** 2)) / power for axes in ALL_AXES}
    expected, best = left[ALL_AXES[0]], min(left.values())
    if expected < ODD_FIT or best > expected * (BETTER if expected > BAD_FIT else MUCH_BETTER):
        return []
    # axes without motion fit either way: of the equally good answers take the one closest to the robot file
    good = [axes for axes in ALL_AXES if left[axes] < best + 0.02]
    axes = max(good, key=lambda candidate: float(np.trace(axes_matrix(candidate))))
    wrong = "; ".join(
        f"its {AXES[k]} looks like {'-' if sign < 0 else '+'}{AXES[axis]}"
        for k, (axis, sign) in enumerate(axes)
        if (axis, sign) != (k, 1)
    )
    text = (
        f"{gyro.name}: the axes seem swapped or flipped against R_imu_body: {wrong}; as it stands "
        f"{100 * expected:.0f} % of the signal do not fit, with those axes {100 * best:.0f} %"
    )
    mirrored = np.linalg.det(axes_matrix(axes)) < 0
    if mirrored:
        text += f"; no rotation does that: {_mirrored(gyro, axes_matrix(axes))}, or a joint counts backwards"
    return [Notice(gyro.name, MIRRORED if mirrored else "axes", 0, text)]


def _mirrored(gyro: Gyro, axes: Array) -> str:
    """What to write for axes of the other hand: R_imu_body is that of axes whose x was turned."""
    turned = np.diag(RIGHT_FROM_LEFT) @ axes @ gyro.R_imu_body
    value = "true" if not gyro.left_handed else "false"
    text = f"set `left_handed: {value}` of sensors.{gyro.name}"
    if np.allclose(turned, gyro.R_imu_body):
        return text
    rows = ", ".join("[" + ", ".join(f"{x:.4g}" for x in row + 0.0) + "]" for row in turned.round(6))
    return f"{text} and its R_imu_body to [{rows}]"


Axes = tuple[tuple[int, int], ...]
ALL_AXES: list[Axes] = [
    tuple(zip(order, signs, strict=True))
    for order in itertools.permutations(range(3))
    for signs in itertools.product((1, -1), repeat=3)
]
"""For each sensor axis the expected axis and sign that it shows; the first entry changes nothing."""


def axes_matrix(axes: Axes) -> Array:
    """The signed permutation matrix, shape (3, 3)."""
    matrix = np.zeros((3, 3))
    for row, (column, sign) in enumerate(axes):
        matrix[row, column] = sign
    return matrix


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(values**2, axis=1))))
