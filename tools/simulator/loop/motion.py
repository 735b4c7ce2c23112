# SPDX-License-Identifier: BSD-3-Clause
"""Where the P-controller shall go, and how hard it may push: the motions of the paper.

`calibration` (Fig. 3): rest, a slow stage with large displacement, first one joint at a time and then all together,
a fast stage in the same order, and a chirp on each joint. `moves` (Sec. 5.2): rest, then other positions at changing
limits, without chirp.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

SLOW, FAST = 0.15, 0.9  # of the full command
REST = 2.0 / 65.0  # share of the time, but at least MIN_REST
MIN_REST = 0.5  # [s]
# Shares of the time after the rest; with 65 s the chirps begin at 53 s, as in Fig. 3.
SLOW_ALONE, SLOW_TOGETHER, FAST_ALONE, FAST_TOGETHER, CHIRPS = np.array([18.0, 12.0, 10.0, 11.0, 9.0]) / 63.0
SLOW_HOLD, FAST_HOLD = 2.0, 0.8  # [s] before the next target
CHIRP_AMPLITUDE = 0.3  # [rad]
CHIRP_FREQUENCIES = (0.5, 10.0)  # [Hz] across the resonances of the springs
RANGE_SHARE, LARGEST = 0.57, 1.5  # target amplitude: share of half the joint's range, but at most [rad]


@dataclass
class Motion:
    """A schedule for the P-controller.

    Attributes:
        times: of the ticks, shape (n,) [s].
        targets: motor angle wanted, shape (n, n_joints) [rad].
        limits: largest command, as a share of the full one, shape (n,); zero is rest.
        amplitude: half the span of the targets of each joint, shape (n_joints,) [rad].
        centre: middle of the targets, shape (n_joints,) [rad].
    """

    times: Array
    targets: Array
    limits: Array
    amplitude: Array
    centre: Array

    def window(self, t0: float, t1: float) -> slice:
        """The ticks with t0 <= time < t1 [s]."""
        i0, i1 = np.searchsorted(self.times, [t0 - 1e-9, t1 - 1e-9])
        return slice(int(i0), int(i1))

    def visit(self, rng: np.random.Generator, joint: int, t0: float, t1: float, hold: float) -> None:
        """Sends a joint to the two sides of its span in turn; it stays at the last target."""
        count = max(1, round((t1 - t0) / hold))
        bounds = np.linspace(t0, t1, count + 1)
        bounds[1:-1] += rng.uniform(-0.2, 0.2, count - 1) * (t1 - t0) / count
        side = rng.choice([-1.0, 1.0])
        for a, b in pairwise(bounds):
            target = self.centre[joint] + side * rng.uniform(0.45, 1.0) * self.amplitude[joint]
            self.targets[self.window(a, b), joint] = target
            self.targets[self.window(b, np.inf), joint] = target
            side = -side

    def chirp(self, joint: int, t0: float, t1: float) -> None:
        """Swings a joint about its present target with rising frequency."""
        window = self.window(t0, t1)
        t, span = self.times[window] - t0, t1 - t0
        f0, f1 = CHIRP_FREQUENCIES
        phase = 2.0 * np.pi * (f0 * t + 0.5 * (f1 - f0) * t**2 / span)
        self.targets[window, joint] += min(CHIRP_AMPLITUDE, self.amplitude[joint]) * np.sin(phase)


def make_motion(name: str, robot: Robot, times: Array, start: Array, rng: np.random.Generator) -> Motion:
    """A motion by name.

    Args:
        name: "calibration" or "moves".
        robot: for its joint limits.
        times: of the ticks, shape (n,) [s].
        start: motor angles at the beginning, shape (n_joints,) [rad].
        rng: draws the targets.

    Returns:
        The schedule.

    Raises:
        SimulationError: unknown name.
    """
    if name not in MOTIONS:
        raise SimulationError(f"unknown motion {name!r}; expected {' or '.join(MOTIONS)}")
    centre, amplitude = joint_span(robot)
    n = len(times)
    motion = Motion(times, np.tile(start, (n, 1)), np.zeros(n), amplitude, centre)
    MOTIONS[name](motion, rng)
    return motion


def start_position(robot: Robot, rng: np.random.Generator) -> Array:
    """A random position near the middle of the range, shape (n_joints,) [rad]."""
    centre, amplitude = joint_span(robot)
    return centre + 0.15 * amplitude * rng.uniform(-1.0, 1.0, robot.n)


def joint_span(robot: Robot) -> tuple[Array, Array]:
    """Centre and amplitude of the targets of each joint, each of shape (n_joints,) [rad]."""
    low, high = robot.tree.limits.T
    bounded = np.isfinite(low) & np.isfinite(high) & (high - low < 1e3)
    half = np.where(bounded, (high - low) / 2.0, np.pi / 2.0)
    return np.where(bounded, (high + low) / 2.0, 0.0), np.minimum(RANGE_SHARE * half, LARGEST)


def _calibration(motion: Motion, rng: np.random.Generator) -> None:
    end = _end(motion)
    t = max(MIN_REST, REST * end)
    moving = end - t
    joints = range(motion.targets.shape[1])
    for limit, hold, alone, together in (
        (SLOW, SLOW_HOLD, SLOW_ALONE, SLOW_TOGETHER),
        (FAST, FAST_HOLD, FAST_ALONE, FAST_TOGETHER),
    ):
        motion.limits[motion.window(t, np.inf)] = limit
        for joint in joints:
            motion.visit(rng, joint, t, t + alone * moving / len(joints), hold)
            t += alone * moving / len(joints)
        for joint in joints:
            motion.visit(rng, joint, t, t + together * moving, hold * rng.uniform(0.8, 1.25))
        t += together * moving
    for joint in joints:
        motion.chirp(joint, t, t + CHIRPS * moving / len(joints))
        t += CHIRPS * moving / len(joints)
    for joint in joints:
        motion.visit(rng, joint, t, end, FAST_HOLD)


def _moves(motion: Motion, rng: np.random.Generator) -> None:
    end = _end(motion)
    t = max(MIN_REST, REST * end)
    for joint in range(motion.targets.shape[1]):
        motion.visit(rng, joint, t, end, rng.uniform(0.9, 1.4))
    while t < end:
        motion.limits[motion.window(t, np.inf)] = rng.choice([SLOW, 0.4, FAST])
        t += rng.uniform(1.5, 3.0)


def _end(motion: Motion) -> float:
    return float(motion.times[-1] + motion.times[1] - motion.times[0])


MOTIONS: dict[str, Callable[[Motion, np.random.Generator], None]] = {"calibration": _calibration, "moves": _moves}
