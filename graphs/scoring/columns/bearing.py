# SPDX-License-Identifier: BSD-3-Clause
"""Columns of a soft bearing, by its compliance: a tilt rings, sensors see its motion, the joints its inertia.

Gyros see its rate, accelerometers its acceleration and how gravity turns, targets its angle. Only the ringing depends
on the resonance that is tried; the rest is worked out once for each bearing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bilinear, lfilter

from jointscope.graphs.scoring.columns.column import Column, SensorColumn, SensorPart
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.robots.bodies.body_accelerations import specific_force
from jointscope.robots.bodies.body_points import body_point
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.model.structured_tree import bearing_names, with_bearings

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Hinge:
    """One of the two hinges, along the smoothed motion.

    Attributes:
        reaction: torque that the bearing carries about it, shape (m + 1,) [N m].
        coupling: rows of the mass matrix between the links and it, shape (m + 1, n_link) [kg m2].
        seen: what every gyro, accelerometer and target sees of a tilt, of its speed and of its acceleration, by name,
            shape (m + 1, 3) each.
    """

    reaction: Array
    coupling: Array
    seen: Mapping[str, tuple[Array, Array, Array]]


def bearing_columns(hypothesis: EffectHypothesis, s: ScoreSignals) -> list[Column]:
    """One column for the compliance of each hinge: accelerations and what sensors see."""
    hinges = s.shared.get(hypothesis.label)
    if hinges is None:
        hinges = s.shared[hypothesis.label] = _hinges(hypothesis.here.owner, s)
    omega, ratio = 2.0 * np.pi * hypothesis.shapes["frequency"], hypothesis.shapes["damping_ratio"]
    found, n = [], s.model.layout.n_link
    for hinge in hinges:
        tilt = -_resonance(hinge.reaction, s.ticks, omega, ratio)
        speed = np.gradient(tilt, s.ticks)
        rise = np.gradient(speed, s.ticks)
        tau = np.zeros((len(s.ticks), s.model.layout.n_rates))
        tau[:, :n] = -hinge.coupling * rise[:, None]
        motion = (tilt, speed, rise)
        seen = {
            name: np.sum([by * part[:, None] for by, part in zip(slopes, motion, strict=True)], axis=0)
            for name, slopes in hinge.seen.items()
        }
        found.append(Column(at_ticks=s.accelerations(tau), reading=_interpolated(seen, s.ticks)))
    return found


def _hinges(owner: str, s: ScoreSignals) -> list[_Hinge]:
    """Both hinges of a bearing at rest."""
    layout = s.model.layout
    tree = s.robot.kinematic_tree.with_model(with_bearings(s.robot.kinematic_tree.model, (owner,)))
    names = tree.joints
    old = np.array([names.index(name) for name in layout.links])
    q, v, a = (np.zeros((len(s.ticks), len(names))) for _ in range(3))
    q[:, old], v[:, old], a[:, old] = s.x[:, layout.q_link], s.x[:, layout.v_link], s.a_link
    reaction, M = tree.torque(q, v, a), tree.mass_matrix(q)
    # accelerometers are compared with the acceleration of the smoothed motion, not with that of the model
    slopes = _slopes(tree, s, q, v, np.asarray(np.gradient(v, s.ticks, axis=0)))
    found = []
    for b in map(names.index, bearing_names(owner)):
        seen = {name: (by_q[:, :, b], by_v[:, :, b], by_a[:, :, b]) for name, (by_q, by_v, by_a) in slopes.items()}
        found.append(_Hinge(reaction[:, b], M[:, old, b], seen))
    return found


def _slopes(tree: RigidTree, s: ScoreSignals, q: Array, v: Array, a: Array) -> dict[str, tuple[Array, Array, Array]]:
    """Derivatives of what sensors of the links see by q, v and a, in their own axes, shape (m + 1, 3, n) each."""
    found = {}
    gyros = {gyro.name: gyro for gyro in s.robot.gyros}
    for gyro in gyros.values():
        _, by_q, by_v = tree.body_rate(gyro.body, q, v)
        found[gyro.name] = gyro.R_imu_body @ by_q, gyro.R_imu_body @ by_v, np.zeros_like(by_v)
    for sensor in s.robot.accelerometers:
        gyro, lever, gravity = gyros[sensor.gyro], sensor.place(s.robot.parameters), s.robot.gravity_at(sensor)
        f = specific_force(tree, gyro.body, lever, q, v, a, gravity)
        found[sensor.name] = gyro.R_imu_body @ f.by_q, gyro.R_imu_body @ f.by_v, gyro.R_imu_body @ f.by_a
    values = s.robot.values
    for target in s.robot.targets:
        at, R, _, _ = target.seen(values)
        by_q = R.T @ body_point(tree, target.body, at, q).by_q
        found[target.name] = by_q, np.zeros_like(by_q), np.zeros_like(by_q)
    return found


def _interpolated(signals: dict[str, Array], ticks: Array) -> SensorColumn:
    def column(part: SensorPart) -> Array:
        if part.name not in signals:
            return np.zeros(part.reading.shape)
        signal = signals[part.name]
        return np.column_stack([np.interp(part.stamps, ticks, signal[:, channel]) for channel in part.channels])

    return column


def _resonance(signal: Array, ticks: Array, omega: float, ratio: float) -> Array:
    """Response of a mass on spring and damper, with unit gain at rest."""
    h = float(np.median(np.diff(ticks)))
    b, a = bilinear([omega**2], [1.0, 2.0 * ratio * omega, omega**2], fs=1.0 / h)
    start = signal[0]
    return np.asarray(lfilter(b, a, signal - start) + start, dtype=np.float64)
