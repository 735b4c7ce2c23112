# SPDX-License-Identifier: BSD-3-Clause
"""What motors and links read at the same instants while springs are locked, as far as it is new.

Encoders have steps, and a joint that stands reads the same again and again: an instant counts once an encoder has moved
on by a step since the last one. The stream with fewer samples gives the instants, the other one is interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording, Stream

Array = NDArray[np.float64]

STEP = np.sqrt(12.0)  # of an encoder, in its sigmas
GAP = 3.0  # periods between two samples that nothing is interpolated over
HALF_WINDOW = 0.02  # [s] at least, of the speed of the links
MOST = 3000  # instants
FEWEST = 10  # for each value that is looked for
MOVED = 30.0  # sigmas of a link's encoder that a joint must move by to tell its column


@dataclass(frozen=True)
class LockedReadings:
    """m instants of one recording in which the springs of k of the n joints are locked.

    Attributes:
        path, sha256: of the bag.
        joints: whose springs are locked, shape (k,), in the order of the robot's.
        rows: their places among the robot's joints, shape (k,).
        times: of the instants, shape (m,) [s].
        q_motor: motor encoders of these joints, shape (m, k) [rad].
        q_link: link encoders of all joints, shape (m, n) [rad].
        v_link, a_link: speed [rad/s] and acceleration [rad/s^2] of the links, shape (m, n).
        sigma_motor, sigma_link: of the encoders, shape (k,) and (n,) [rad].
        still: joints that stand, whose columns nothing tells, shape (n,).
    """

    path: str
    sha256: str
    joints: tuple[str, ...]
    rows: NDArray[np.intp]
    times: Array
    q_motor: Array
    q_link: Array
    v_link: Array
    a_link: Array
    sigma_motor: Array
    sigma_link: Array
    still: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.q_motor)

    @staticmethod
    def of(recording: Recording, robot: Robot, joints: tuple[str, ...]) -> LockedReadings:
        """Pairs the encoders of a recording.

        Args:
            recording: in which springs are locked.
            robot: with encoders on motors and links.
            joints: whose springs are locked.

        Raises:
            RecordingError: no encoders on the links, a locked joint that stands, or hardly any motion.
        """
        link = robot.link_encoder
        if link is None:
            raise RecordingError(no_link_encoders(recording.path, robot))
        rows = np.array([robot.joints.index(joint) for joint in joints])
        motors, links = recording.streams[robot.motor_encoder.name].whole, recording.streams[link.name].whole
        sigma_motor, sigma_link = robot.motor_encoder.sigmas[rows], link.sigmas
        times = _common_times(motors, links)
        half = max(HALF_WINDOW, 2.0 * float(np.median(np.diff(links.times))) if len(links) > 1 else 0.0)
        times = times[(times > links.times[0] + half) & (times < links.times[-1] - half)] if len(times) else times
        q_motor = _at(motors, times)[:, rows] - robot.motor_encoder.zero[rows]
        before, q_link, after = (_at(links, times + shift) - link.zero for shift in (-half, 0.0, half))
        v_link, a_link = (after - before) / (2.0 * half), (after - 2.0 * q_link + before) / half**2
        kept = _news(np.hstack([q_motor, q_link]), STEP * np.concatenate([sigma_motor, sigma_link]))
        found = LockedReadings(
            recording.path, recording.sha256, joints, rows, times[kept], q_motor[kept], q_link[kept],
            v_link[kept], a_link[kept], sigma_motor, sigma_link, np.zeros(robot.n, bool),
        )  # fmt: skip
        return found._with_still(robot)

    def _with_still(self, robot: Robot) -> LockedReadings:
        """With joints that stand; those whose springs are locked must not.

        Raises:
            RecordingError: they do, or nothing moves enough.
        """
        span = np.ptp(self.q_link, axis=0) if len(self) else np.zeros(robot.n)
        still = span < MOVED * self.sigma_link
        standing = [j for j in self.joints if still[robot.joints.index(j)]]
        needed = FEWEST * (int((~still).sum()) + 1)
        if standing:
            place = robot.joints.index(standing[0])
            raise RecordingError(
                f"{self.path}: {', '.join(standing)} {'stands' if len(standing) == 1 else 'stand'} still "
                f"({standing[0]} spans {span[place]:.2g} {robot.unit_at(standing[0], 'rad')}) though the spring is "
                "said to be locked; move every such joint, or name the others as `locked_springs: [JOINT, ...]` in "
                f"{robot_argument(robot)}"
            )
        if len(self) < needed:
            raise RecordingError(
                f"{self.path}: motors and links read something new {len(self)} times; expected {needed} for the matrix "
                "between them: move the joints farther, one after the other"
            )
        return replace(self, still=still)


def no_link_encoders(path: str | Path, robot: Robot) -> str:
    """Why a recording with locked springs is of no use to a robot without encoders on its links."""
    return (
        f"{path}: with locked springs motors and links are compared, and {robot.path.name} has no sensor of kind "
        "link_encoder; add one, or leave the recording out"
    )


def _common_times(motors: Stream, links: Stream) -> Array:
    """Instants at which both streams are known."""
    slow, fast = (motors, links) if len(motors) <= len(links) else (links, motors)
    if len(fast) < 2 or len(slow) < 2:
        return np.zeros(0)
    times = slow.times[(slow.times >= fast.times[0]) & (slow.times <= fast.times[-1])]
    place = np.clip(np.searchsorted(fast.times, times), 1, len(fast) - 1)
    return np.asarray(times[fast.times[place] - fast.times[place - 1] < GAP * float(np.median(np.diff(fast.times)))])


def _at(stream: Stream, times: Array) -> Array:
    """A stream between its samples; straight lines would cut the corners of each turn to the same side."""
    if len(stream) < 2 or not len(times):
        return np.zeros((len(times), stream.values.shape[1]))
    return np.asarray(PchipInterpolator(stream.times, stream.values, axis=0)(times))


def _news(readings: Array, steps: Array) -> NDArray[np.intp]:
    """Instants since which before an encoder has moved by a step, at most so many, evenly.

    Args:
        readings: shape (m, c).
        steps: shape (c,).
    """
    kept: list[int] = []
    scaled, last = readings / steps, np.full(readings.shape[1], np.inf)
    for i, now in enumerate(scaled):
        if np.max(np.abs(now - last)) >= 1.0:
            kept.append(i)
            last = now
    chosen = np.array(kept, dtype=np.intp)
    return chosen[:: max(1, -(-len(chosen) // MOST))]
