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
Stretches = tuple[tuple[float, float], ...]

SATURATED = 3.0  # tanh of this is 1 to half a percent: dry friction is a sign from here on
SLOW = 1e-3  # of the 95 % speed
LOOK = 0.02  # [s] over which an encoder may show a speed, five samples at least
CLEARLY = 0.5  # of the speed at which friction has its full size, what is wanted to be told from zero
RESOLVED = 3.0  # [sigma] of that speed
ADDED_SPRING = "joint_elasticity"  # the effect that makes a rigid joint elastic
SLOW_EFFECTS = ("motor_stribeck", "pwm_deadband")  # of which nothing is seen at higher speeds
STIFF = 1.0  # times that friction may stop a motor in one step
DOUBTFUL = 3.0  # times the speed of full friction, up to which a step may turn a motor over whose friction is stiff
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

    An elastic one has an equation of its own for its motor, see `holding_motors`; one that got its spring as an effect
    has it, too, but its link may be seen by nothing else than what its motor does.

    A joint whose sharpness is looked for is left out where its encoder does not tell it from standing. One with an
    effect of slow motion keeps what tells that, unless its friction is held as a sign, and so does one that hardly
    moves beside what its encoder shows.
    """
    found = {}
    for joint in robot.joints:
        elastic = joint in robot.layout.motors and not robot.has_effect(ADDED_SPRING, joint)
        stretches = None if elastic else _standing(robot, recording, joint)
        if stretches is not None:
            found[joint] = stretches
    return replace(recording, sticking=found)


def asked_joints(robot: Robot) -> list[str]:
    """Joints whose sharpness of dry friction is looked for."""
    return [joint for joint in robot.joints if _is_asked(robot, joint)]


def holding_sharpness(robot: Robot, recordings: Sequence[Recording]) -> Robot:
    """The robot with the dry friction of each joint that looks for its sharpness as a sign, as far as motion tells.

    A true sign drives the sharpness up without an end, and what a model lacks drives it down, until friction is one
    more viscous one that hides it. Held so that friction has its full size at a small part of the joint's own speed, or
    at the slowest that the encoder tells from zero, standstill can be left out.
    """
    parameters = dict(robot.parameters)
    for joint in asked_joints(robot):
        slowest = [slowest_seen(robot, recording, joint) for recording in recordings]
        if np.all(np.isfinite(slowest)) and min(slowest) > 0.0:
            name = f"{joint}.{SHARPNESS}"
            parameters[name] = replace(parameters[name], value=SATURATED / min(slowest), fixed=True)
    return replace(robot, parameters=parameters)


def slowest_seen(robot: Robot, recording: Recording, joint: str) -> float:
    """The slowest speed of a joint that its encoder tells from zero, or a small part of its own [rad/s, m/s]."""
    encoder, j = robot.motor_encoder, robot.joints.index(joint)
    stream, sigma = recording.streams[encoder.name].channel(j), float(encoder.sigmas[j])
    q, times = stream.values[:, 0], stream.times
    v, _, _ = _speed(times, q, sigma, 0.0)
    grain = GRAIN * float(np.quantile(np.abs(v), 0.95))
    return max(grain, _speed(times, q, sigma, grain)[1])


def holding_motors(robot: Robot, recording: Recording, h: Array) -> dict[str, Stretches]:
    """Stretches in which each elastic joint's motor stands, where its friction is stiff.

    Over a step of length h the rounded law stops a slow motor many times over if mu k h is above its inertia. No rule
    of integration follows that: the cost has a minimum of its own for every tick of a motor that stands, and a process
    noise that took what friction does there would hide what happens in motion. So the law is silent there, and what
    friction does is left open.

    Args:
        robot: the model, with friction, sharpness and inertias as its file says.
        recording: tells by its encoder where motors stand.
        h: lengths of the steps, shape (m,) [s].
    """
    found = {}
    for joint in stiff_motors(robot, float(np.median(h)) if len(h) else 0.0):
        if robot.has_effect(ADDED_SPRING, joint):
            continue  # `leaving_standstill_out` says what is asked of it
        stretches = _standing(robot, recording, joint, DOUBTFUL)
        if stretches is not None:
            found[joint] = stretches
    return found


def stiff_motors(robot: Robot, h: float) -> list[str]:
    """Elastic joints whose friction would stop a motor more than once in a step of length h [s].

    Not those whose sharpness is looked for: it says what friction does there.
    """
    found = []
    for joint in robot.layout.motors:
        if not _is_asked(robot, joint) and stiffness(robot, joint, h) > STIFF:
            found.append(joint)
    return found


def stiffness(robot: Robot, joint: str, h: float) -> float:
    """How many times the dry friction of a joint stops its motor in a step of length h [s], at the lowest speeds."""
    friction = robot.drive_parameter(joint, "coulomb_torque").value * robot.sharpness_of(joint)
    return h * friction / robot.drive_parameter(joint, "inertia").value


def only_stiff_motors(robot: Robot, h: float) -> bool:
    """Whether all joints have one, and the friction is that of the motors' velocity."""
    return stiff_motors(robot, h) == list(robot.joints) and robot.choices.friction_velocity == "motor"


def _is_asked(robot: Robot, joint: str) -> bool:
    """Whether the sharpness of a joint's friction is looked for."""
    own = robot.parameters.get(f"{joint}.{SHARPNESS}")
    return own is not None and not own.fixed


def _standing(robot: Robot, recording: Recording, joint: str, times: float = 1.0) -> Stretches | None:
    """Where a joint is too slow for its friction to be known; None where that is wanted, or cannot be seen.

    Args:
        robot: the model.
        recording: the data.
        joint: which one.
        times: the speed at which friction has its full size, below which the joint is too slow.
    """
    encoder, j = robot.motor_encoder, robot.joints.index(joint)
    stream = recording.streams[encoder.name].channel(j)
    elastic = joint in robot.layout.motors and not robot.has_effect(ADDED_SPRING, joint)
    asked = _is_asked(robot, joint)
    held = f"{joint}.{SHARPNESS}" in robot.parameters and not asked  # as a sign
    slow_effects = any(robot.has_effect(id, joint) for id in SLOW_EFFECTS)
    if slow_effects and not (elastic or held):
        return None
    rounded = slowest_seen(robot, recording, joint) if asked else SATURATED / robot.sharpness_of(joint)
    v, seen, reach = _speed(stream.times, stream.values[:, 0], float(encoder.sigmas[j]), CLEARLY * rounded)
    hardly = HARDLY_MOVES * float(np.quantile(np.abs(v), 0.95))
    if seen >= max(rounded, hardly):
        return None
    slow = np.abs(v) < max(seen, min(times * rounded, hardly))
    slow[1:] |= v[1:] * v[:-1] < 0.0
    return _stretches(slow, stream.times, reach)


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


def _stretches(mask: Mask, ticks: Array, reach: float) -> Stretches:
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
