# SPDX-License-Identifier: BSD-3-Clause
"""Kinds of motion in which effects show: standstill, reversals, fast motion, high load, nearness to limits.

All thresholds come from the recording and the sensors, none from a particular robot. Regimes overlap: a joint may be
fast while another reverses. "other" is what belongs to none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.problem.joint_states import JointStates
from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

REGIMES = ("standstill", "reversal", "fast", "loaded", "near limits", "other")
WHOLE_ROBOT = ("standstill", "other")  # regimes that do not belong to a joint

SIGMAS = 3.0  # a speed is told from zero if it is larger than this many sigmas
SPEED_WINDOW = 0.05  # [s] over which an encoder shows a speed
REAL_MOTION = 0.05  # of the joint's usual top speed; slower wobbles have no reversals
AROUND_REVERSAL = 0.05  # [s] before and after
LONGEST_STOP = 0.1  # [s] a longer pause makes it a stop and a start, not a reversal
UPPER = 0.8  # quantile above which speed and load are high
NEAR = 0.05  # of the range between the limits


@dataclass(frozen=True)
class MotionRegimes:
    """Which regime holds when.

    Attributes:
        times: shape (m,) [s].
        masks: by name of REGIMES, shape (m, n), one column per joint; shape (m, 1) for those of the whole robot.
        thresholds: lower bound of |v| for "fast" [rad/s] and of |load| for "loaded" [N m or rad/s^2], shape (n,).
        still: speed below which each joint cannot be told from one that stands still, shape (n,) [rad/s or m/s].
        load_unit: "N m" of the spring, or "rad/s^2" where the model has no springs.
    """

    times: Array
    masks: Mapping[str, Mask]
    thresholds: Mapping[str, Array]
    still: Array
    load_unit: str

    def at(self, times: Array) -> dict[str, Mask]:
        """Masks at the nearest instants, each of shape (k, n) or (k, 1)."""
        right = np.clip(np.searchsorted(self.times, times), 1, len(self.times) - 1)
        nearest = np.where(times - self.times[right - 1] < self.times[right] - times, right - 1, right)
        return {name: mask[nearest] for name, mask in self.masks.items()}


def motion_regimes(robot: Robot, motion: JointStates) -> MotionRegimes:
    """Divides a motion into regimes.

    Args:
        robot: gives limits and sigmas of the sensors.
        motion: at least two instants, close enough to see reversals.
    """
    still = slowest_visible_speed(robot)
    speed = np.abs(motion.v)
    load, load_unit = _load(motion)
    fast = _upper(np.where(speed > still, speed, np.nan))
    loaded = _upper(np.where(np.any(speed > still, axis=1, keepdims=True), np.abs(load), np.nan))
    masks = {
        "standstill": np.all(speed <= still, axis=1, keepdims=True),
        "reversal": np.column_stack([_reversals(motion.times, v, s) for v, s in zip(motion.v.T, still, strict=True)]),
        "fast": speed >= fast,
        "loaded": np.abs(load) >= loaded,
        "near limits": _near_limits(joint_angles(robot, motion.q), robot.tree.limits),
    }
    masks["other"] = ~np.any(np.hstack(list(masks.values())), axis=1, keepdims=True)
    return MotionRegimes(motion.times, masks, {"fast": fast, "loaded": loaded}, still, load_unit)


def slowest_visible_speed(robot: Robot) -> Array:
    """Speed that encoders over 50 ms, or a gyro, tell from zero, shape (n,) [rad/s, of a prismatic joint m/s]."""
    by_encoder = np.sqrt(2.0) * robot.motor_encoder.sigmas / SPEED_WINDOW
    by_gyro = min((gyro.sigma for gyro in robot.gyros), default=np.inf)
    slides = np.isin(robot.joints, robot.tree.slides)
    return SIGMAS * np.where(slides, by_encoder, np.minimum(by_encoder, by_gyro))


def _load(motion: JointStates) -> tuple[Array, str]:
    """Load of each joint and its unit; rigid joints have springs without torque."""
    if np.any(np.isfinite(motion.load) & (motion.load != 0.0)):
        return motion.load, "N m"
    return np.gradient(motion.v, motion.times, axis=0), "rad/s^2"


def _upper(values: Array) -> Array:
    """Where the upper fifth of each column begins; infinite where nothing is known."""
    bounds = np.full(values.shape[1], np.inf)
    for j, column in enumerate(values.T):
        known = column[np.isfinite(column)]
        if len(known) and np.max(known) > 0.0:
            bounds[j] = np.quantile(known, UPPER)
    return bounds


def _reversals(times: Array, v: Array, still: float) -> Mask:
    """Whether an instant is near a sign change between two real motions, shape (m,)."""
    real = max(still, REAL_MOTION * float(np.quantile(np.abs(v), 0.95)))
    moving = np.flatnonzero(np.abs(v) > real)
    before, after = moving[:-1], moving[1:]
    turned = (v[before] * v[after] < 0.0) & (times[after] - times[before] <= LONGEST_STOP)
    centres = 0.5 * (times[before[turned]] + times[after[turned]])
    first = np.searchsorted(centres, times - AROUND_REVERSAL)
    return np.asarray(np.searchsorted(centres, times + AROUND_REVERSAL, side="right") > first)


def _near_limits(q: Array, limits: Array) -> Mask:
    lower, upper = limits.T
    bounded = np.isfinite(lower) & np.isfinite(upper)
    margin = np.where(bounded, NEAR * (np.where(bounded, upper, 0.0) - np.where(bounded, lower, 0.0)), 0.0)
    return np.asarray(bounded & ((q < lower + margin) | (q > upper - margin)))
