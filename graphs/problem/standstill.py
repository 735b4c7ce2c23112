# SPDX-License-Identifier: BSD-3-Clause
r"""Where a joint sticks dry friction takes any value of its band: its equation of motion tells nothing there.

The model rounds friction off, mu tanh(k v): a joint that stands under a torque would creep, and one that turns over
would do so without a stop. So all that is slower than friction needs for its full size is left to the sensors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from jointscope.robots.model.robot import SHARPNESS, Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SATURATED = 3.0  # tanh of this is 1 to half a percent: dry friction is a sign from here on
SLOW = 1e-3  # of the 95 % speed
LOOK = 0.02  # [s] over which an encoder may show a speed, five samples at least
CLEARLY = 0.5  # of the speed at which friction has its full size, what is wanted to be told from zero
RESOLVED = 3.0  # [sigma] of that speed
SLOW_EFFECTS = ("motor_stribeck", "pwm_deadband")  # of which nothing is seen at higher speeds
HARDLY_MOVES = 0.25  # of the 95 % speed; no more is left out
GRAIN = 0.003  # of the 95 % speed, at which friction that is taken for a sign has its full size


def slowest_speed(v: Array, sharpness: float) -> float:
    """Speed below which friction is not known [rad/s, m/s]; v of shape (m,)."""
    return max(SATURATED / sharpness, SLOW * float(np.quantile(np.abs(v), 0.95)))


def near(mask: Mask, steps: int) -> Mask:
    """A mask widened by a number of steps on both sides, shape (m,)."""
    if steps < 1:
        return mask
    return np.asarray(np.convolve(mask.astype(float), np.ones(2 * steps + 1), mode="same") > 0.5)


def leaving_standstill_out(robot: Robot, recording: Recording) -> Recording:
    """The recording with the stretches in which each rigid joint is too slow for the size of its friction to be known.

    An elastic one has an equation of its own for its motor, whose process noise takes what friction does at rest; one
    that got its spring as an effect has it, too, but its link may be seen by nothing else than what its motor does.

    A joint whose sharpness is looked for keeps them: they tell it, as they tell effects of slow motion unless its
    friction is held as a sign. So does one whose encoder does not show them.
    """
    encoder, found = robot.motor_encoder, {}
    stream = recording.streams[encoder.name]
    for j, joint in enumerate(robot.joints):
        own = robot.parameters.get(f"{joint}.{SHARPNESS}")
        asked = own is not None and not own.fixed
        sign = own is not None and own.fixed
        told = asked or (not sign and any(robot.has_effect(id, joint) for id in SLOW_EFFECTS))
        rounded = SATURATED / robot.sharpness_of(joint)
        if told or (joint in robot.layout.motors and not robot.has_effect("joint_elasticity", joint)):
            continue
        v, seen, reach = _speed(stream.times, stream.values[:, j], float(encoder.sigmas[j]), CLEARLY * rounded)
        if seen < rounded:
            slow = np.abs(v) < max(seen, min(rounded, HARDLY_MOVES * float(np.quantile(np.abs(v), 0.95))))
            slow[1:] |= v[1:] * v[:-1] < 0.0
            found[joint] = _stretches(slow, stream.times, reach)
    return replace(recording, sticking=found)


def holding_sharpness(robot: Robot, recordings: Sequence[Recording]) -> Robot:
    """The robot with the dry friction of each joint that looks for its sharpness as a sign, as far as motion tells.

    A true sign drives the sharpness up without an end, and what a model lacks drives it down, until friction is one
    more viscous one that hides it. Held so that friction has its full size at a small part of the joint's own speed, or
    at the slowest that the encoder tells from zero, standstill can be left out.
    """
    parameters, encoder = dict(robot.parameters), robot.motor_encoder
    for j, joint in enumerate(robot.joints):
        own = robot.parameters.get(f"{joint}.{SHARPNESS}")
        if own is None or own.fixed:
            continue
        slowest = []
        for recording in recordings:
            stream = recording.streams[encoder.name]
            q, times = stream.values[:, j], stream.times
            v, _, _ = _speed(times, q, float(encoder.sigmas[j]), 0.0)
            grain = GRAIN * float(np.quantile(np.abs(v), 0.95))
            slowest.append(max(grain, _speed(times, q, float(encoder.sigmas[j]), grain)[1]))
        if np.all(np.isfinite(slowest)) and min(slowest) > 0.0:
            parameters[f"{joint}.{SHARPNESS}"] = replace(own, value=SATURATED / min(slowest), fixed=True)
    return replace(robot, parameters=parameters)


def _speed(times: Array, q: Array, sigma: float, wanted: float) -> tuple[Array, float, float]:
    """Slopes of local parabolas over as few samples as show the wanted speed, at most LOOK or five samples.

    Returns:
        Slopes, shape (m,), the speed that they tell from zero, and half the width of the parabolas [s].
    """
    period = float(np.median(np.diff(times)))
    grid = np.arange(times[0], times[-1] + 0.5 * period, period)
    for half in range(1, max(round(0.5 * LOOK / period), 2) + 1):
        count = 2 * half + 1
        seen = RESOLVED * sigma / (period * np.sqrt(count * (count**2 - 1) / 12.0))
        if seen < wanted:
            break
    if len(grid) < count:
        return np.full(len(times), np.inf), np.inf, half * period
    slope = savgol_filter(np.interp(grid, times, q), count, 2, deriv=1, delta=period, mode="interp")
    return np.interp(times, grid, slope), float(seen), half * period


def _stretches(mask: Mask, ticks: Array, reach: float) -> tuple[tuple[float, float], ...]:
    """Times in which a mask holds, widened by `reach` [s] and joined where they touch."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    joined: list[tuple[float, float]] = []
    for first, after in edges.reshape(-1, 2):
        t0, t1 = float(ticks[first]) - reach, float(ticks[after - 1]) + reach
        if joined and t0 <= joined[-1][1]:
            joined[-1] = (joined[-1][0], t1)
        else:
            joined.append((t0, t1))
    return tuple(joined)
