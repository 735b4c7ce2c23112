# SPDX-License-Identifier: BSD-3-Clause
"""The steps of a recording as torques: what is missing in each, and what base parameters and columns add to it.

The defect d of the accelerations asks for the torque (M + rotors) d. Where a parameter is part of M or of the rotors,
that torque changes with it, too: what accelerates a heavier rotor is the motion that was seen, not that of a model that
lacks something. Without this a heavier rotor and a heavier link would differ by just what is missing, and a column that
base parameters imitate would explain all of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.graphs.scoring.columns.column import Column, SensorPart
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.graphs.scoring.score_system import ScoreRows, Segment, rows_of

Array = NDArray[np.float64]

STEP = 1e-3  # of a parameter: M is linear in those that it knows


@dataclass(frozen=True)
class TorqueSteps:
    """All steps of one segment, m of them with r equations.

    Attributes:
        segment: where they come from.
        inertia: M with rotors, shape (m + 1, r, r) [kg m2].
        turn: from rows of the dynamics, which are impulses on the links alone, to torques, shape (m, r, r).
        missing: shape (m, r) [N m].
        base: what it changes by with the base parameters, shape (m, r, p).
    """

    segment: Segment
    inertia: Array
    turn: Array
    missing: Array
    base: Array

    @staticmethod
    def of(segment: Segment) -> TorqueSteps:
        """From a segment of a robot whose joints are all rigid."""
        s = segment.signals
        inertia, turn, missing, base = _inertia(s, s.parameters), [], [], []
        alone = segment.problem.robot.free_inertias()[None, :]
        for factor, part in _dynamics(segment, ()):
            assert factor.steps.weight is not None
            impulse = np.broadcast_to(factor.sigmas, part.residual.shape)[:, : alone.shape[1]] * alone
            links = factor.steps.weight * alone[:, :, None]
            turn.append(inertia[part.ticks] @ np.linalg.inv(links) * (impulse / factor.steps.h[:, None])[:, None, :])
            missing.append((turn[-1] @ part.residual[:, : alone.shape[1], None])[:, :, 0])
            base.append(-turn[-1] @ part.by_block[DYNAMICS][:, : alone.shape[1]])
        found = TorqueSteps(segment, inertia, np.concatenate(turn), np.concatenate(missing), np.concatenate(base))
        # columns of candidates take the acceleration from ticks on either side, so this does, too: what differs between
        # the two is no heavier link
        seen, v = s.rate[:, s.model.layout.v_link], s.x[:, s.model.layout.v_link]
        blurred = 0.5 * (seen[1:] + seen[:-1]) - np.diff(v, axis=0) / np.diff(s.ticks)[:, None]
        defect = np.linalg.solve(inertia[:-1], found.missing[:, :, None]) + blurred[:, :, None]
        for i, slope in _slopes(segment, inertia).items():
            found.base[:, :, i] -= (slope[:-1] @ defect)[:, :, 0]
        return found

    def columns(self, columns: Sequence[Column]) -> Array:
        """What columns add to the missing torque, shape (m, r, k)."""
        moved, found, r = _moved(self.segment, columns), [], self.missing.shape[1]
        for _, part in _dynamics(self.segment, [replace(c, reading=None) for c in columns]):
            found.append(part.by_size + sum(J @ moved[part.ticks + i] for i, J in enumerate(part.by_state)))
        return -self.turn @ np.concatenate(found)[:, :r]


def _dynamics(segment: Segment, columns: Sequence[Column]) -> list[tuple[DynamicsFactor, ScoreRows]]:
    """Pieces of the dynamics with their rows: these come first, in the order of their pieces."""
    dynamics = [f for f, _, _ in segment.linearized if isinstance(f, DynamicsFactor)]
    return list(zip(dynamics, rows_of(segment, columns), strict=False))


def _inertia(s: ScoreSignals, parameters: Array) -> Array:
    """M with rotors at all ticks, shape (m + 1, r, r)."""
    return np.asarray(np.linalg.inv(s.model.without_command(s.x, parameters).rigid.by_torque), dtype=np.float64)


def _slopes(segment: Segment, inertia: Array) -> dict[int, Array]:
    """Derivative of M with rotors by the coordinates of parameters that it knows, shape (m + 1, r, r) each."""
    s, found, per_coordinate = segment.signals, dict[int, Array](), segment.calibration.value_by_coordinate
    some = replace(s, x=s.x[:1])
    for i in range(len(s.parameters)):
        step = np.zeros(len(s.parameters))
        step[i] = STEP * max(abs(float(s.parameters[i])), STEP)
        if not np.array_equal(_inertia(some, s.parameters + step), _inertia(some, s.parameters)):
            found[i] = (_inertia(s, s.parameters + step) - inertia) / step[i] * per_coordinate[i]
    return found


def _moved(segment: Segment, columns: Sequence[Column]) -> Array:
    """How far errors of readings move the states, which follow fine encoders, shape (m + 1, d, k)."""
    s, encoder = segment.signals, segment.problem.robot.motor_encoder
    q, v = s.model.layout.joint_q, s.model.layout.joint_v
    part = SensorPart(encoder.name, np.arange(len(q)), s.ticks, s.x[:, q], s.x[:, v], s.rate[:, v])
    found = np.zeros((*s.x.shape, len(columns)))
    for i, column in enumerate(columns):
        if column.reading is not None:
            error = column.reading(part)
            found[:, q, i] = -error
            found[:, v, i] = -np.gradient(error, s.ticks, axis=0, edge_order=2)
    return found
