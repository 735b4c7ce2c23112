# SPDX-License-Identifier: BSD-3-Clause
"""Columns of a soft bearing, by its compliance: a tilt rings, gyros see its rate, the joints its inertia."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bilinear, lfilter

from jointscope.graphs.columns.column import Column, SensorColumn, SensorPart
from jointscope.graphs.trial_signals import TrialSignals
from jointscope.graphs.trials import Trial
from jointscope.robots.rigid_tree import RigidTree
from jointscope.robots.structured_tree import bearing_names, with_bearings

Array = NDArray[np.float64]


def bearing_columns(trial: Trial, s: TrialSignals) -> list[Column]:
    """One column for the compliance of each hinge: accelerations and what gyros see."""
    owner, layout = trial.here.owner, s.model.layout
    tree = s.robot.kinematic_tree.with_model(with_bearings(s.robot.kinematic_tree.model, (owner,)))
    names = tree.joints
    old = np.array([names.index(name) for name in layout.links])
    q, v, a = (np.zeros((len(s.ticks), len(names))) for _ in range(3))
    q[:, old], v[:, old], a[:, old] = s.x[:, layout.q_link], s.x[:, layout.v_link], s.a_link
    reaction, M = tree.torque(q, v, a), tree.mass_matrix(q)
    omega, ratio = 2.0 * np.pi * trial.shapes["frequency"], trial.shapes["damping_ratio"]
    found = []
    for name in bearing_names(owner):
        b = names.index(name)
        tilt = -_resonance(reaction[:, b], s.ticks, omega, ratio)
        speed = np.gradient(tilt, s.ticks)
        tau = np.zeros((len(s.ticks), layout.n_rates))
        tau[:, : layout.n_link] = -M[:, old, b] * np.gradient(speed, s.ticks)[:, None]
        rates = _gyro_rates(s, tree, q, v, b, tilt, speed)
        found.append(Column(at_ticks=s.accelerations(tau), reading=_interpolated(rates, s.ticks)))
    return found


def _gyro_rates(
    s: TrialSignals, tree: RigidTree, q: Array, v: Array, b: int, tilt: Array, speed: Array
) -> dict[str, Array]:
    """What every gyro sees of a tilting bearing, by name, shape (m + 1, 3) [rad/s]."""
    found = {}
    for gyro in s.robot.gyros:
        _, by_q, by_v = tree.body_rate(gyro.body, q, v)
        found[gyro.name] = (by_q[:, :, b] * tilt[:, None] + by_v[:, :, b] * speed[:, None]) @ gyro.R_imu_body.T
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
