# SPDX-License-Identifier: BSD-3-Clause
"""What a motor held while links still swung: how far, either way, they turned each spring after the motor had stopped.

A link that swings on pulls its motor from one side of the friction band to the other, and the motor slips until the
largest pull stays within it. Where links come to rest at last lies nearer to the middle of the band then, by as much
as they swung, and a band that ended at the outermost rest would be too narrow. The turning points of the swing were
held as well. There links stand for a moment, so that damping of the spring is nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from jointscope.robots.dynamics.transmission import joint_angles, motor_angles
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Encoder
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.robots.rests.swing import readings_alike

Array = NDArray[np.float64]
ARRAYS = ("links", "commands", "sigma", "fall")
SIDES = (1.0, -1.0)
GLITCH, SURELY = 6.0, 5.0  # times the usual bend between three readings, and [sigma] beside it, of one that is far off
CROSSED = 3.0  # [sigma] to each side of the middle, of a swing that crosses it
FEWEST_CROSSINGS = 3
SMOOTHED = 1.0 / 6.0  # of a period, over which readings are one parabola: 0.03 % off at a turning point
PARABOLA = 2.25  # variance of the middle of a parabola through k readings, times k
SHORTEST_WINDOW = 3  # readings
FEWEST_READINGS = 8  # of a period, which miss a turning point by 7 % at the most
MANY = 10  # turning points, from which on swings of several frequencies say little of how the first one decays
SWINGS = 1.2  # [sigma] that the deflection of a spring varies by, where noise alone leaves one
FAR = 5.0  # [sigma] of a turning point, from which it is one


@dataclass(frozen=True)
class TurningPoints:
    """The farthest turning point of each spring to each side, of m rests; zero where nothing swung.

    Attributes:
        links: by how much each link was off its rest there, in joint coordinates, shape (m, 2, n) [rad].
        commands: by how much each command was off its mean, shape (m, 2, n).
        sigma: of the spring's deflection, shape (m, 2, n) [rad].
        fall: by how much its spring may have been bent farther when the motor last slipped: a period before, and by
            what this slip took off, shape (m, 2, n) [rad].
    """

    links: Array
    commands: Array
    sigma: Array
    fall: Array

    @staticmethod
    def none(m: int, n: int) -> TurningPoints:
        """Of rests at which nothing swung."""
        return TurningPoints(*np.zeros((4, m, 2, n)))

    @staticmethod
    def joined(parts: list[TurningPoints]) -> TurningPoints:
        """Of the rests of some recordings, one after the other."""
        return TurningPoints(*(np.concatenate([getattr(part, name) for part in parts]) for name in ARRAYS))

    def only(self, kept: NDArray[np.bool_]) -> TurningPoints:
        """Of some of the rests."""
        return replace(self, **{name: getattr(self, name)[kept] for name in ARRAYS})

    @property
    def any(self) -> bool:
        """Whether anything swung at all."""
        return bool(np.any(self.links))


@dataclass(frozen=True)
class Turn:
    """A turning point.

    Attributes:
        begin, end: of the readings that tell it [s].
        deflection: off the middle [rad].
        sigma: of it [rad].
        period: of the swing [s].
        fall: from the turning point of the same side a period before, as the swing dies away [rad].
    """

    begin: float
    end: float
    deflection: float
    sigma: float
    period: float
    fall: float


def turning_points(
    recording: Recording, robot: Robot, stretch: tuple[float, float], q_link: Array, u: Array
) -> TurningPoints:
    """Of one rest, shapes as of m = 1.

    Args:
        recording: of the robot.
        robot: whose links have encoders.
        stretch: in which motors and load stand [s].
        q_link: where links come to rest, shape (n,) [rad].
        u: mean command, shape (n,).
    """
    link = robot.link_encoder
    assert link is not None
    stream, commands = recording.streams[link.name], recording.streams["command"]
    inside = (stream.times >= stretch[0]) & (stream.times < stretch[1])
    times, seen = stream.times[inside], motor_angles(robot, stream.values[inside])
    middle = motor_angles(robot, q_link + link.zero)
    sigmas = _seen_by_motors(robot, link)
    found, own = TurningPoints.none(1, robot.n), np.zeros((2, robot.n))
    for j in range(robot.n):
        for side, turn in enumerate(farthest_turns(times, seen[:, j], float(middle[j]), float(sigmas[j]))):
            if turn is not None:
                own[side, j], found.sigma[0, side, j] = turn.deflection, turn.sigma
                slipped = _way(recording.streams[robot.motor_encoder.name], j, stretch[0], turn.period)
                found.fall[0, side, j] = turn.fall + min(slipped, abs(turn.deflection))
                held = (commands.times >= turn.begin) & (commands.times <= turn.end)
                if held.any():
                    found.commands[0, side, j] = commands.values[held, j].mean() - u[j]
    found.links[0] = joint_angles(robot, own)
    return found


def still_swinging(recording: Recording, robot: Robot, stretch: tuple[float, float]) -> NDArray[np.bool_]:
    """Whether the spring of each motor swings beyond the noise of its link's encoder, shape (n,).

    A motor that creeps under it slips at the turning points alone: on the average its friction is not all that it is.

    Args:
        recording: of the robot.
        robot: with springs.
        stretch: in which motors stand or creep [s].
    """
    link, motor = robot.link_encoder, robot.motor_encoder
    if link is None:
        return np.zeros(robot.n, dtype=bool)
    stream, turned = recording.streams[link.name], recording.streams[motor.name]
    inside = (stream.times >= stretch[0]) & (stream.times < stretch[1])
    t = stream.times[inside]
    if len(t) < FEWEST_READINGS:
        return np.zeros(robot.n, dtype=bool)
    at_motors = np.column_stack([np.interp(t, turned.times, column) for column in turned.values.T])
    sigmas = _seen_by_motors(robot, link)
    bent = _without_glitches(motor_angles(robot, stream.values[inside]) - at_motors, sigmas)
    line = np.column_stack([np.ones_like(t), t - t.mean()])
    left = bent - line @ np.linalg.lstsq(line, bent)[0]
    return np.asarray(left.std(axis=0) > SWINGS * sigmas)


def farthest_turns(times: Array, readings: Array, middle: float, sigma: float) -> tuple[Turn | None, Turn | None]:
    """The farthest turning points above and below the middle of a swing; None where there is none.

    Args:
        times: shape (k,), evenly spaced, while motors and load stand [s].
        readings: of a spring's deflection or its link's position, shape (k,) [rad].
        middle: where it comes to rest [rad].
        sigma: of one reading [rad].
    """
    away = _without_glitches(readings[:, None], np.array([sigma]))[:, 0] - middle
    period = _period(times, away, CROSSED * sigma)
    if period is None:
        return None, None
    step = float(times[-1] - times[0]) / (len(times) - 1)
    window = max(2 * int(0.5 * SMOOTHED * period / step) + 1, SHORTEST_WINDOW)
    if period < FEWEST_READINGS * step or window >= len(times) // 2:
        return None, None
    smooth, half = savgol_filter(away, window, 2), window // 2
    within = smooth[half:-half]  # a stretch begins anywhere, and its begin is no turning point
    turns = 1 + np.flatnonzero((within[1:-1] - within[:-2]) * (within[2:] - within[1:-1]) <= 0.0)
    turns = turns[np.abs(within[turns]) > FAR * sigma * np.sqrt(PARABOLA / window)]
    if not len(turns):
        return None, None
    decay = _decay(times[half + turns], np.abs(within[turns]))
    found: list[Turn | None] = []
    for side in SIDES:
        own = turns[side * within[turns] > 0.0]
        if not len(own):
            found.append(None)
            continue
        at = half + int(own[np.argmax(np.abs(within[own]))])
        fewer = np.sum(1.0 / readings_alike(readings[at - half : at + half + 1]))
        noise = sigma * float(np.sqrt(min(PARABOLA / fewer, 1.0)))
        fall = abs(float(smooth[at])) * float(np.expm1(decay * period))
        found.append(Turn(float(times[at - half]), float(times[at + half]), float(smooth[at]), noise, period, fall))
    return found[0], found[1]


def _seen_by_motors(robot: Robot, link: Encoder) -> Array:
    """Sigmas of the links' encoders as the motors see the links, shape (n,) [rad]."""
    return np.asarray(np.sqrt(motor_angles(robot, np.eye(robot.n)).T ** 2 @ link.sigmas**2))


def _without_glitches(readings: Array, sigmas: Array) -> Array:
    """Readings, shape (k, n), of which those far off both neighbours are replaced by the mean of these.

    A median would cut off the turning points of a swing that has few readings.
    """
    found = readings.copy()
    between = 0.5 * (readings[:-2] + readings[2:])
    off = np.abs(readings[1:-1] - between)
    # the neighbours of a glitch are off by half of it, to the other side
    beside = np.pad(off, ((1, 1), (0, 0)))
    far = (off > GLITCH * np.median(off, axis=0) + SURELY * sigmas) & (off >= np.maximum(beside[:-2], beside[2:]))
    found[1:-1][far] = between[far]
    return found


def _way(motors: Stream, j: int, begin: float, period: float) -> float:
    """How far a motor went in the last half period before it stood [rad]."""
    inside = (motors.times >= begin - 0.5 * period) & (motors.times <= begin)
    return float(np.ptp(motors.values[inside, j])) if inside.any() else 0.0


def _decay(times: Array, sizes: Array) -> float:
    """How fast a swing dies away, from the sizes of its first turning points; 0 where these do not fall [1/s]."""
    t, log = times[:MANY] - times[0], np.log(sizes[:MANY])
    if len(t) < FEWEST_CROSSINGS:
        return 0.0
    return max(-float(np.polyfit(t, log, 1)[0]), 0.0)


def _period(times: Array, away: Array, far: float) -> float | None:
    """Of a swing that goes beyond `far` to both sides in turn; None where it does not [s]."""
    beyond = np.flatnonzero(np.abs(away) > far)
    crossings = beyond[1:][away[beyond[1:]] * away[beyond[:-1]] < 0.0]
    if len(crossings) < FEWEST_CROSSINGS:
        return None
    return 2.0 * float(times[crossings[-1]] - times[crossings[0]]) / (len(crossings) - 1)
