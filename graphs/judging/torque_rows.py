# SPDX-License-Identifier: BSD-3-Clause
"""The equations of motion as rows of torques: what is missing, and what parameters and candidates would add to it.

The defect of every step, stated as a torque, is averaged with a Hann window one period of the band wide and thinned.
Rows whose window touches a standstill, a left-out stretch or the end of a recording are dropped: the window is finite,
so nothing of these leaks into the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.priors import DynamicsPrior
from jointscope.graphs.problem.standstill import near, slowest_speed
from jointscope.graphs.scoring.columns.column import Column, SensorPart
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.graphs.scoring.score_columns import columns_of
from jointscope.graphs.scoring.score_system import Segment, rows_of

Array = NDArray[np.float64]

PER_WINDOW = 4  # rows per period of the band


@dataclass(frozen=True)
class TorqueRows:
    """Rows of one equation, of all recordings one after the other.

    Attributes:
        joint: whose equation.
        times: shape (m,) [s], each recording far from the one before.
        missing: what the model lacks, shape (m,) [N m].
        base: what it changes by with the base parameters, shape (m, p).
        drive: torque of the drive without friction, shape (m,) [N m].
        q, v: motion, shape (m,) [rad], [rad/s].
        slowest: speed below which nothing is told [rad/s].
    """

    joint: str
    times: Array
    missing: Array
    base: Array
    drive: Array
    q: Array
    v: Array
    slowest: float


@dataclass(frozen=True)
class Window:
    """How steps of one segment become rows of one equation.

    Attributes:
        weights: of the Hann window, summing to one.
        kept: middle step of every row.
    """

    weights: Array
    kept: NDArray[np.intp]

    def averaged(self, values: Array) -> Array:
        """Rows from steps, shape (m, ...) to (rows, ...)."""
        half = len(self.weights) // 2
        return np.asarray(
            sum(w * values[self.kept + i - half] for i, w in enumerate(self.weights)), dtype=np.float64
        ).reshape(len(self.kept), *values.shape[1:])


@dataclass(frozen=True)
class TorqueEquations:
    """All equations of all segments.

    Attributes:
        segments: linearised pieces of the recordings.
        windows: by segment, by equation.
        rows: one entry for each joint.
        signals: of each segment, with accelerations of the motion and the commands that these ask for, not those that
            were logged: they hold what is missing, and in a loop the disturbances, too.
        expected, sigma: change of the base parameters that their prior expects, and its standard deviation, shape (p,).
    """

    segments: Sequence[Segment]
    windows: list[list[Window]]
    rows: list[TorqueRows]
    signals: list[ScoreSignals]
    expected: Array
    sigma: Array

    @staticmethod
    def of(segments: Sequence[Segment], band: float) -> TorqueEquations:
        """From segments of a robot whose joints are all rigid.

        Args:
            segments: linearised at the base model's solution.
            band: frequency at which the window lets half of the amplitude pass [Hz].
        """
        robot = segments[0].problem.robot
        windows = [[_window(s, j, band) for j in range(robot.n)] for s in segments]
        driven = [_steps(s, [Column(in_steps=by) for by in np.moveaxis(s.signals.response, 2, 0)]) for s in segments]
        found, start = [], np.cumsum([0.0, *(float(np.ptp(s.signals.ticks)) + 10.0 for s in segments)])
        for j, joint in enumerate(robot.joints):
            parts = []
            for i, s in enumerate(segments):
                window, x, layout = windows[i][j], s.signals.x, s.signals.model.layout
                row, (missing, base, by_command) = int(layout.joint_link[j]), driven[i]
                drive = by_command[:, row, j] * s.signals.u[:, j]
                parts.append(
                    (
                        start[i] + s.signals.ticks[window.kept] - s.signals.ticks[0],
                        window.averaged(missing[:, row]),
                        window.averaged(base[:, row]),
                        window.averaged(drive),
                        x[window.kept, layout.joint_q[j]],
                        x[window.kept, layout.joint_v[j]],
                    )
                )
            times, missing, base, drive, q, v = (np.concatenate(c) for c in zip(*parts, strict=True))
            slowest = max(_slowest(s, j) for s in segments)
            found.append(TorqueRows(joint, times, missing, base, drive, q, v, slowest))
        prior = DynamicsPrior.of(robot)
        expected = -prior.residual((), segments[0].calibration)[0]
        signals = [_asked_for(s, missing, gains) for s, (missing, _, gains) in zip(segments, driven, strict=True)]
        return TorqueEquations(segments, windows, found, signals, expected, prior.sigma)

    def columns(self, hypothesis: EffectHypothesis) -> list[Array] | None:
        """What each size of a hypothesis adds to the missing torque, shape (m, k) by equation; None for numerics."""
        by_segment = []
        for s, signals in zip(self.segments, self.signals, strict=True):
            columns = columns_of(hypothesis, signals)
            if not columns or any(c.better_integrator for c in columns):
                return None
            by_segment.append(_steps(s, columns)[2])
        layout = self.segments[0].signals.model.layout
        return [
            np.concatenate(
                [w[j].averaged(c[:, int(layout.joint_link[j])]) for w, c in zip(self.windows, by_segment, strict=True)]
            )
            for j in range(len(self.rows))
        ]


def _steps(segment: Segment, columns: Sequence[Column]) -> tuple[Array, Array, Array]:
    """Missing torque, shape (m, r), and what base parameters and columns add, shape (m, r, p) and (m, r, k)."""
    robot, r = segment.problem.robot, len(segment.signals.model.layout.velocities)
    # rows weigh the links alone; what a rigid joint moves is its motor, too
    alone = robot.free_inertias()[None, :].copy()
    for j, joint in enumerate(robot.joints):
        if joint not in robot.tree.massless:
            alone[0, int(segment.signals.model.layout.joint_link[j])] += segment.signals.inertia[j]
    missing, base, by_size = [], [], []
    dynamics = [f for f, _, _ in segment.linearized if isinstance(f, DynamicsFactor)]
    torques, moved = [replace(c, reading=None) for c in columns], _moved(segment, columns)
    # the first rows come from the dynamics, in the order of their pieces
    for factor, part in zip(dynamics, rows_of(segment, torques), strict=False):
        scale = np.broadcast_to(factor.sigmas, part.residual.shape)[:, :r] * alone / factor.steps.h[:, None]
        change = part.by_size + sum(J @ moved[part.ticks + i] for i, J in enumerate(part.by_state))
        missing.append(part.residual[:, :r] * scale)
        base.append(-part.by_block[DYNAMICS][:, :r] * scale[:, :, None])
        by_size.append(-change[:, :r] * scale[:, :, None])
    return np.concatenate(missing), np.concatenate(base), np.concatenate(by_size)


def _moved(segment: Segment, columns: Sequence[Column]) -> Array:
    """How far errors of readings move the states, which follow fine encoders, shape (m + 1, d, k)."""
    s, encoder = segment.signals, segment.problem.robot.motor_encoder
    q, v = s.model.layout.joint_q, s.model.layout.joint_v
    part = SensorPart(encoder.name, np.arange(len(q)), s.ticks, s.x[:, q], s.x[:, v])
    found = np.zeros((*s.x.shape, len(columns)))
    for i, column in enumerate(columns):
        if column.reading is not None:
            error = column.reading(part)
            found[:, q, i] = -error
            found[:, v, i] = -np.gradient(error, s.ticks, axis=0, edge_order=2)
    return found


def _asked_for(segment: Segment, missing: Array, gains: Array) -> ScoreSignals:
    """Signals with the commands that the motion asks for; missing torque (m, r), torque per command (m, r, n)."""
    s, u = segment.signals, segment.signals.u.copy()
    for j, row in enumerate(s.model.layout.joint_link):
        u[:, j] += missing[:, row] / gains[:, row, j]
    return replace(s, u=u, a_link=s.rate[:, s.model.layout.v_link], shared={})


def _slowest(segment: Segment, j: int) -> float:
    signals = segment.signals
    v = signals.x[:, signals.model.layout.joint_v[j]]
    return slowest_speed(v, signals.robot.sharpness_of(signals.robot.joints[j]))


def _window(segment: Segment, j: int, band: float) -> Window:
    signals, problem = segment.signals, segment.problem
    h = float(np.median(np.diff(signals.ticks)))
    half = max(round(0.5 / (band * h)), 1)
    weights = np.hanning(2 * half + 3)[1:-1]
    v = signals.x[:-1, signals.model.layout.joint_v[j]]
    ticks = signals.ticks
    wrong = (np.abs(v) < _slowest(segment, j)) | (np.diff(ticks) > 1.5 * h)
    wrong |= ~problem.recording.are_judged(ticks[1:], problem.timeline.h)
    wrong |= np.r_[False, v[1:] * v[:-1] < 0.0]
    good = ~near(wrong, half)
    good[: half + 1] = good[len(good) - half - 1 :] = False
    every = max(2 * half // PER_WINDOW, 1)
    kept = np.flatnonzero(good & (np.arange(len(good)) % every == 0))
    return Window(weights / weights.sum(), kept)
