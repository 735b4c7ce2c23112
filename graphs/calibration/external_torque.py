# SPDX-License-Identifier: BSD-3-Clause
"""Moments in which a torque acts on a link that the same motion does not ask for at other times: a push, a collision.

An effect of the robot comes back: whenever a joint passes the same position at the same speed and load, the same
torque is missing. What a hand does to the robot does not come back. The recording is cut into bins; the mean torque
that the equation of a link lacks in a bin is held against that in those bins elsewhere whose motion is most alike,
joint by joint. Where it is many times larger, and where such bins hold much of all that is missing, they are named.
Motors are not looked at: nobody reaches them, and dry friction holds a resting one with torques that never come back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label, maximum
from scipy.spatial import KDTree

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem, first_command_time
from jointscope.graphs.problem.joint_states import JointStates
from jointscope.graphs.problem.motion_regimes import slowest_visible_speed
from jointscope.graphs.problem.standstill import leaving_standstill_out
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.model.lasting_torques import equation_inertias
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

BIN = 0.05  # [s]
APART = 20  # bins nearer than this are the same event
ALIKE = 12  # bins of the most similar motion that are asked
QUANTILE = 0.75  # of their missing torques
FAR = 8.0  # times that a torque must be larger than those, and than what is usual
STILL_LARGE = 2.0  # the same, where the moment rises and dies away
OF_PEAK = 0.05  # share of its largest torque that it still has there
TOGETHER = 0.25  # [s] bins nearer than this are one moment
MUCH = 0.3  # share of all that an equation lacks which its moments must hold
ONE = 0.1  # share that a single moment must hold
RARE = 0.1  # share of the time in which they may lie
FEWEST = 80  # bins below which nothing is said
PRACTICAL = 0.02  # of what the motor gives (rms): a smaller torque matters to nobody, however clearly it stands out


@dataclass(frozen=True)
class ExternalTorque:
    """One moment.

    Attributes:
        t0, t1: limits [s].
        row: equation with the largest torque: "joint2.link".
        torque: largest mean over a bin there [unit].
        share: of all squared torque that this equation lacks.
        unit: "N m", of a prismatic joint "N".
    """

    t0: float
    t1: float
    row: str
    torque: float
    share: float
    unit: str

    def sentence(self, recording: Recording) -> str:
        """The moment in plain words, with what can be done about it."""
        stretch = f"{recording.path}:{self.t0:.2f}:{self.t1:.2f}"
        return (
            f"{recording.path}: from {self.t0:.2f} to {self.t1:.2f} s up to {abs(self.torque):.2g} {self.unit} act on "
            f"{self.row} that the same motion does not ask for at other times ({100 * self.share:.0f} % of the "
            "squared torque that the model lacks there): a push from outside, a collision or a slip looks like this, "
            f"no effect of the catalogue does; if it is not the robot's own, leave it out with --leave-out {stretch}"
        )

    def to_json(self) -> dict[str, float | str]:
        """Fit for JSON."""
        return {
            "t0": self.t0,
            "t1": self.t1,
            "row": self.row,
            "torque": self.torque,
            "unit": self.unit,
            "share": self.share,
        }


def external_torques_of(problem: BagProblem, x: Array, calibration: Calibration) -> tuple[ExternalTorque, ...]:
    """As `external_torques`, for a recording with its model.

    Whoever smoothed these states may have asked standstills, too. Here a joint that friction may hold says nothing, and
    what it lacks then is in no equation but its own.

    Args:
        problem: the recording.
        x: smoothed states, shape (m + 1, d).
        calibration: values and biases.
    """
    robot = problem.robot.with_values(calibration.by_name)
    recording = problem.recording
    known = {**leaving_standstill_out(robot, recording).sticking, **recording.sticking}
    if known != recording.sticking:
        problem = problem.of_recording(replace(recording, sticking=known))
    defects = problem.dynamics.residual((x[:-1], x[1:]), calibration)
    return external_torques(robot, problem.recording, problem.timeline.ticks, x, defects)


def external_torques(
    robot: Robot, recording: Recording, ticks: Array, x: Array, defects: Array
) -> tuple[ExternalTorque, ...]:
    """The moments of a recording, in the order of time; none where what is missing comes back, or nothing is missing.

    Stretches that are left out already are not looked at.

    Args:
        robot: the model.
        recording: the data.
        ticks: times of the states, shape (m + 1,) [s].
        x: smoothed states, shape (m + 1, d).
        defects: residuals of the dynamics, links first, shape (m, >= n_link) [rad/s].
    """
    start = max(first_command_time(recording), float(ticks[0]))
    edges = np.asarray(start + BIN * np.arange(int((ticks[-1] - start) / BIN) + 1), float)
    edges = edges[recording.are_judged(edges, BIN) & np.append(recording.are_judged(edges[1:], BIN), True)]
    whole = np.diff(edges) < 1.5 * BIN
    if np.sum(whole) < FEWEST:
        return ()
    torque = _means(ticks, _impulses(robot, ticks, x, defects), edges)[whole]
    centres = (0.5 * (edges[:-1] + edges[1:]))[whole]
    motion = JointStates.of(robot, ticks, x).at(centres)
    held = _held_by_friction(robot, recording, motion, float(np.max(np.diff(ticks))))
    torque = np.where(held, 0.0, torque)
    rare = _rare(torque, ~held, motion)
    large = np.max(np.abs(np.where(rare, torque, 0.0)), axis=0) > PRACTICAL * _given(robot, recording)
    return _moments(robot, centres, torque, rare & large)


def _given(robot: Robot, recording: Recording) -> Array:
    """Root mean square torque of the motor behind each link, of the strongest one where there is none [N m]."""
    model = ElasticJoints(robot)
    gain = np.abs(model.drive_gain(np.array([robot.parameters[name].value for name in model.names])))
    rms = gain * np.sqrt(np.mean(recording.command.values**2, axis=0))
    given = np.full(robot.layout.n_link, np.max(rms))
    given[robot.layout.joint_link] = rms
    return given


def _impulses(robot: Robot, ticks: Array, x: Array, defects: Array) -> Array:
    """What the equation of each link lacks in each step, shape (m, n_link) [N m s]."""
    layout = robot.layout
    lacking = defects[:, : layout.n_link]
    if robot.noise.n_lasting:  # most of it is in the torques that last
        w = x[:, layout.size - robot.noise.n_lasting :][:, : layout.n_link]
        lacking = lacking + 0.5 * (w[1:] + w[:-1]) * np.diff(ticks)[:, None]
    return lacking * equation_inertias(robot)[: layout.n_link]


def _means(ticks: Array, impulses: Array, edges: Array) -> Array:
    """Mean torque in each bin, shape (bins, n_link) [N m]."""
    reached = np.vstack([np.zeros(impulses.shape[1]), np.cumsum(impulses, axis=0)])
    at_edges = np.column_stack([np.interp(edges, ticks, column) for column in reached.T])
    return np.diff(at_edges, axis=0) / np.diff(edges)[:, None]


def _held_by_friction(robot: Robot, recording: Recording, motion: JointStates, step: float) -> NDArray[np.bool_]:
    """Where a rigid joint rests: its link is held by the friction of its motor, shape (bins, n_link).

    What is free in a step [s] may reach into the bin that begins within it.
    """
    layout = robot.layout
    held = np.zeros((len(motion.times), layout.n_link), bool)
    slow = np.abs(motion.v) <= slowest_visible_speed(robot)
    for j, joint in enumerate(robot.joints):
        if joint not in layout.motors:
            sticks = recording.sticks(joint, motion.times + 0.5 * BIN + step, BIN + 2.0 * step)
            held[:, layout.joint_link[j]] = slow[:, j] | sticks
    return held


def _rare(torque: Array, told: NDArray[np.bool_], motion: JointStates) -> NDArray[np.bool_]:
    """Bins and links that lack far more than bins of like motion, shape (bins, n_link); of those that tell."""
    size = np.abs(torque)
    load = np.where(np.isfinite(motion.load), motion.load, np.gradient(motion.v, motion.times, axis=0))
    signals = [np.column_stack(columns) for columns in zip(motion.q.T, motion.v.T, load.T, strict=True)]
    rare = np.zeros_like(told)
    for i in range(size.shape[1]):
        bins = np.flatnonzero(told[:, i])
        if len(bins) < FEWEST:
            continue
        own, expected = size[bins, i], np.full(len(size), np.inf)
        expected[bins] = np.median(own)
        for columns in signals:
            alike = own[_alike(columns[bins], bins)]
            expected[bins] = np.maximum(expected[bins], np.quantile(alike, QUANTILE, axis=1))
        rare[:, i] = _grown(size[:, i], expected)
    share = np.sum(np.where(rare, size**2, 0.0), axis=0) / np.maximum(np.sum(size**2, axis=0), 1e-300)
    return np.asarray(rare & (share > MUCH) & (np.mean(rare, axis=0) < RARE))


def _grown(size: Array, expected: Array) -> NDArray[np.bool_]:
    """Bins far above what is expected, with those around where the same torque rises and dies away, shape (bins,)."""
    regions, count = label(size > STILL_LARGE * expected)
    numbers = np.arange(count + 1)
    peaks = np.append(np.inf, maximum(size, regions, numbers[1:])) if count else np.full(1, np.inf)
    seeds = np.isin(numbers, regions[size > FAR * expected])
    return np.asarray(seeds[regions] & (size > OF_PEAK * peaks[regions]))


def _alike(signals: Array, numbers: NDArray[np.intp]) -> NDArray[np.intp]:
    """The bins whose signals are nearest to those of each bin without being the same event, shape (bins, ALIKE).

    Args:
        signals: of each bin, shape (bins, 3).
        numbers: of the bins in the order of time, shape (bins,).
    """
    features = signals / np.maximum(np.std(signals, axis=0), 1e-12)
    _, near = KDTree(features).query(features, k=2 * APART + ALIKE)
    other = np.abs(numbers[near] - numbers[:, None]) >= APART
    first = np.argsort(~other, axis=1, kind="stable")[:, :ALIKE]
    return np.take_along_axis(near, first, axis=1)


def _moments(robot: Robot, centres: Array, torque: Array, found: NDArray[np.bool_]) -> tuple[ExternalTorque, ...]:
    """Bins that lie together, each group with the equation that lacks the largest torque."""
    places = np.flatnonzero(np.any(found, axis=1))
    total = np.maximum(np.sum(torque**2, axis=0), 1e-300)
    moments = (
        _moment(robot, centres[group], np.where(found[group], torque[group], 0.0), total)
        for group in _groups(places, centres)
    )
    return tuple(moment for moment in moments if moment.share > ONE)


def _groups(places: NDArray[np.intp], centres: Array) -> Sequence[NDArray[np.intp]]:
    if not len(places):
        return ()
    return np.split(places, np.flatnonzero(np.diff(centres[places]) > TOGETHER) + 1)


def _moment(robot: Robot, centres: Array, torque: Array, total: Array) -> ExternalTorque:
    shares = np.sum(torque**2, axis=0) / total
    j = int(np.argmax(np.max(np.abs(torque), axis=0)))
    row = robot.layout.rate_names[j]
    peak = float(torque[np.argmax(np.abs(torque[:, j])), j])
    owner = row.removesuffix(".link")
    unit = robot.unit_at(owner, "N m") if owner in robot.joints else "N m"
    held = centres[torque[:, j] != 0.0]  # other equations may lack something beside it, before and after
    return ExternalTorque(float(held[0] - BIN), float(held[-1] + BIN), row, peak, float(shares[j]), unit)
