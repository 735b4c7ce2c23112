# SPDX-License-Identifier: BSD-3-Clause
"""Rests of a robot: stretches in which motors, links and load stand, each with its means and how far they may be off.

A motor stands where its encoder stays within its noise, or creeps (creep.py). Links swing on for seconds, so the end
of a stretch counts, and what parts of it differ by says how well its mean is known. Where the whole stretch shows a
swing whose middle is known better (swing.py), the middle counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Encoder
from jointscope.robots.recordings.recording import Notice, Recording, Stream
from jointscope.robots.recordings.still_stretches import OFTEN, SHORTEST, WITHIN, share_of, standing
from jointscope.robots.rests.creep import PARTS, creep_of, creeping_stretches
from jointscope.robots.rests.left_out import SWINGING, drift, notices_of, why_none
from jointscope.robots.rests.load_history import LoadHistory
from jointscope.robots.rests.swing import middle_of_swing
from jointscope.robots.rests.turning_points import TurningPoints, still_swinging, turning_points

Array = NDArray[np.float64]
SHARES = (1.0, 0.7, 0.5, 0.35, 0.25)  # of its end that may be looked at; that counts whose parts agree best
ARRAYS = ("times", "q_motor", "u", "motor_scatter", "link_scatter", "u_scatter", "forces", "moved", "creep")
FEWEST = 3  # rests; fewer, where motors do not stand often, are motion


@dataclass(frozen=True)
class Rests:
    """The m rests of one recording.

    Attributes:
        path, sha256: of the bag.
        times: begin and end of what is looked at, shape (m, 2) [s].
        q_motor: mean readings of the motor encoders, shape (m, n) [rad].
        q_link: of the link encoders, or the middles of swings, shape (m, n) [rad]; None without.
        u: mean command in its SI unit, shape (m, n).
        motor_scatter, link_scatter, u_scatter: by how much parts of each rest differ, shape (m, n).
        forces, links: known load of each rest, shape (m, 3) [N], and the link that it acts on.
        moved: whether each motor has moved since the last rest, and its friction tells something, shape (m, n).
        creep: velocity of motors that slide on slowly, shape (m, n) [rad/s]; 0 where they stand.
        notices: what was left out.
        rounding: what a swing across the steps of a link encoder leaves of its sigma, shape (m, n); 1 where it stands,
            None where all do.
        turning_points: of links that swung on while motors stood already; None where none did.
    """

    path: str
    sha256: str
    times: Array
    q_motor: Array
    q_link: Array | None
    u: Array
    motor_scatter: Array
    link_scatter: Array
    u_scatter: Array
    forces: Array
    links: tuple[str, ...]
    moved: NDArray[np.bool_]
    creep: Array
    notices: tuple[Notice, ...] = ()
    rounding: Array | None = None
    turning_points: TurningPoints | None = None

    def __len__(self) -> int:
        return len(self.q_motor)

    def only(self, kept: NDArray[np.bool_]) -> Rests:
        """Some of the rests."""
        some = {name: getattr(self, name)[kept] for name in ARRAYS}
        links = tuple(link for link, keep in zip(self.links, kept.tolist(), strict=True) if keep)
        q_link, rounding = (None if part is None else part[kept] for part in (self.q_link, self.rounding))
        turns = None if self.turning_points is None else self.turning_points.only(kept)
        return replace(self, q_link=q_link, rounding=rounding, turning_points=turns, links=links, **some)

    @property
    def turned(self) -> TurningPoints:
        """`turning_points` of all rests."""
        return self.turning_points or TurningPoints.none(*self.q_motor.shape)

    @property
    def rounded(self) -> Array:
        """`rounding` of all rests, shape (m, n)."""
        return np.ones_like(self.q_motor) if self.rounding is None else self.rounding


def joined_rests(recordings: Sequence[Rests]) -> Rests:
    """The rests of some recordings of one robot, one after the other."""
    if len(recordings) == 1:
        return recordings[0]
    together = {name: np.concatenate([getattr(rests, name) for rests in recordings]) for name in ARRAYS}
    seen = [rests.q_link for rests in recordings if rests.q_link is not None]
    links, notices = (sum((getattr(rests, name) for rests in recordings), ()) for name in ("links", "notices"))
    paths = ", ".join(rests.path for rests in recordings)
    together["rounding"] = np.concatenate([rests.rounded for rests in recordings])
    swung = any(rests.turning_points is not None for rests in recordings)
    turns = TurningPoints.joined([rests.turned for rests in recordings]) if swung else None
    q_link = np.concatenate(seen) if seen else None
    return Rests(paths, "", q_link=q_link, links=links, notices=notices, turning_points=turns, **together)


def find_rests(recording: Recording, robot: Robot, loads: LoadHistory) -> Rests:
    """Cuts the rests out of a recording.

    Args:
        recording: of the robot.
        robot: with the sigmas of its encoders.
        loads: what hung on the arm, on the clock of the recording.

    Raises:
        RecordingError: there is none, with the reason.
    """
    motor, link = robot.motor_encoder, robot.link_encoder
    stream, still = recording.streams[motor.name], standing(recording, robot)
    stretches = _split(sorted([*still, *creeping_stretches(recording, robot, still)]), loads.changes)
    stands = set(_split(still, loads.changes))
    found, swinging, drifts, turns = [], 0, list[float](), list[TurningPoints]()
    for t0, t1 in stretches:
        a = _most_settled(recording, motor.name if link is None else link.name, t0, t1)
        q_motor, motor_scatter = _mean(recording, motor.name, a, t1)
        u, u_scatter = _mean(recording, "command", a, t1)
        q_link, link_scatter = (q_motor * np.nan, q_motor * 0.0) if link is None else _mean(recording, link.name, a, t1)
        # a motor that creeps moves the links of others
        drifts.append(drift(recording, robot, t0, t1) if (t0, t1) in stands else 0.0)
        if link is not None and np.any(link_scatter > SWINGING * link.sigmas):
            swinging += 1
            continue
        rounding, turned = np.ones_like(q_link), TurningPoints.none(1, robot.n)
        if link is not None and (t0, t1) in stands:
            q_link, link_scatter, rounding = _swung(recording, link, (t0, t1), q_link, link_scatter)
            turned = turning_points(recording, robot, (t0, t1), q_link - link.zero, u)
        turns.append(turned)
        zero = 0.0 if link is None else link.zero
        creep, known = creep_of(stream, motor.sigmas, a, t1)
        if np.any(creep):
            known &= (creep == 0.0) | ~still_swinging(recording, robot, (a, t1))
            creep = np.where(known, creep, 0.0)
        positions, scatters = (
            (q_motor - motor.zero, q_link - zero, u),
            (motor_scatter, link_scatter, u_scatter, rounding),
        )
        found.append((known, creep, np.array([a, t1]), *positions, *scatters))
    if not found:
        raise RecordingError(why_none(recording, still, stretches, swinging))
    share = share_of(still, stream.times)
    if len(found) < FEWEST and share < OFTEN:
        raise RecordingError(
            f"{recording.path}: the motors stand {100 * share:.0f} % of the time only; expected rests; a recording of "
            f"motion stands before the first option: jointscope calibrate {robot_argument(robot)} {recording.path} "
            f"-o {edited_argument(robot, 'calibrated')}"
        )
    known, creep, times, q_motor, q_link, u, motor_scatter, link_scatter, u_scatter, rounding = map(
        np.array, zip(*found, strict=True)
    )
    hung = [loads.at(float(t[1]) - 1e-9) for t in times]
    moved = _moved(stream, motor, times, q_motor)
    forces, links = np.array([force for force, _ in hung]), tuple(name for _, name in hung)
    notices = notices_of(len(found), swinging, np.array(drifts))
    rests = Rests(
        recording.path, recording.sha256, times, q_motor, None if link is None else q_link, u,
        motor_scatter, link_scatter, u_scatter, forces, links, moved, creep, notices, rounding,
        TurningPoints.joined(turns) if any(turned.any for turned in turns) else None,
    )  # fmt: skip
    last = _last_of_each(rests)
    rests = rests.only(last)
    moved = _moved(stream, motor, rests.times, rests.q_motor) | (rests.creep != 0.0)
    return replace(rests, moved=moved & known[last])


def _split(stretches: Sequence[tuple[float, float]], changes: Array) -> list[tuple[float, float]]:
    """The stretches cut where another load begins."""
    found = []
    for t0, t1 in stretches:
        edges = [t0, *(t for t in changes.tolist() if t0 < t < t1), t1]
        found += [(a, b) for a, b in pairwise(edges) if b - a >= SHORTEST]
    return found


def _most_settled(recording: Recording, name: str, t0: float, t1: float) -> float:
    """Begin of that end of a stretch whose parts agree best."""
    begins = [t1 - share * (t1 - t0) for share in SHARES if share * (t1 - t0) >= SHORTEST]
    return min(begins, key=lambda a: float(np.sum(_mean(recording, name, a, t1)[1] ** 2)), default=t0)


def _mean(recording: Recording, name: str, t0: float, t1: float) -> tuple[Array, Array]:
    """Mean of a stream in a stretch, and by how much its parts differ, shape (n,) each."""
    stream = recording.streams[name]
    inside = stream.values[(stream.times >= t0) & (stream.times < t1)]
    if len(inside) < PARTS:  # commands come when they change
        k = max(int(np.searchsorted(stream.times, t1, side="right")) - 1, 0)
        return stream.values[k], np.zeros(stream.values.shape[1])
    parts = np.array([part.mean(axis=0) for part in np.array_split(inside, PARTS)])
    return inside.mean(axis=0), parts.std(axis=0)


def _swung(
    recording: Recording, link: Encoder, stretch: tuple[float, float], q: Array, scatter: Array
) -> tuple[Array, Array, Array]:
    """Means and scatters, where a swing's middle is known better with this, and what is left of the encoder's sigma.

    Args:
        recording: of the robot.
        link: encoders of the links.
        stretch: in which motors and load stand [s].
        q: means, shape (n,) [rad].
        scatter: by how much parts differ, shape (n,) [rad].
    """
    stream = recording.streams[link.name]
    inside = (stream.times >= stretch[0]) & (stream.times < stretch[1])
    q, scatter, rounding = q.copy(), scatter.copy(), np.ones_like(q)
    for j, sigma in enumerate(link.sigmas.tolist()):
        found = middle_of_swing(stream.times[inside], stream.values[inside, j], sigma)
        if found is not None and found.sigma < np.hypot(sigma, scatter[j]):
            rounding[j] = min(found.sigma / sigma, 1.0)
            q[j], scatter[j] = found.value, np.sqrt(max(found.sigma**2 - sigma**2, 0.0))
    return q, scatter, rounding


def _moved(stream: Stream, motor: Encoder, times: Array, q_motor: Array) -> NDArray[np.bool_]:
    """Whether motors have moved since the rest before, or since the recording began, shape (m, n).

    Who left and came back to the same place has moved, too. One reading far off is a glitch, two in a row are motion.

    Args:
        stream: readings of the motors.
        motor: their encoder.
        times: begin and end of the rests, shape (m, 2) [s].
        q_motor: means, shape (m, n) [rad].
    """
    begins = np.searchsorted(stream.times, np.append(stream.times[0], times[:-1, 0]))
    ends = np.searchsorted(stream.times, times[:, 0])
    moved = np.zeros(q_motor.shape, dtype=bool)
    for i, (begin, end) in enumerate(zip(begins.tolist(), ends.tolist(), strict=True)):
        off = np.abs(stream.values[begin : end + 1] - motor.zero - q_motor[i]) > WITHIN * motor.sigmas
        moved[i] = off[0] | np.any(off[1:] & off[:-1], axis=0)
    return moved


def _last_of_each(rests: Rests) -> NDArray[np.bool_]:
    """Of rests in a row with one load and no motor moved, the last one."""
    same = [
        not rests.moved[i + 1].any()
        and np.array_equal(rests.forces[i], rests.forces[i + 1])
        and rests.links[i] == rests.links[i + 1]
        for i in range(len(rests) - 1)
    ]
    return ~np.array([*same, False], dtype=bool)
