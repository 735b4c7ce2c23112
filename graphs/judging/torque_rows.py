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

from jointscope.factors.priors import DynamicsPrior
from jointscope.graphs.judging.elastic_reaction import beside_springs, is_spring, reaction_column
from jointscope.graphs.judging.torque_steps import TorqueSteps
from jointscope.graphs.problem.standstill import near, slowest_speed
from jointscope.graphs.scoring.columns.column import Column
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.graphs.scoring.score_columns import columns_of
from jointscope.graphs.scoring.score_system import Segment

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
        steps: of each piece of the recordings.
        windows: by segment, by equation.
        rows: one entry for each joint.
        signals: of each segment, with accelerations of the motion and the commands that these ask for, not those that
            were logged: they hold what is missing, and in a loop the disturbances, too.
        expected, sigma: change of the base parameters that their prior expects, and its standard deviation, shape (p,).
        band: frequency at which the windows let half of the amplitude pass [Hz].
    """

    steps: Sequence[TorqueSteps]
    windows: list[list[Window]]
    rows: list[TorqueRows]
    signals: list[ScoreSignals]
    expected: Array
    sigma: Array
    band: float

    @staticmethod
    def of(segments: Sequence[Segment], band: float, springs: Sequence[EffectHypothesis] = ()) -> TorqueEquations:
        """From segments of a robot whose joints are all rigid.

        Args:
            segments: linearised at the base model's solution.
            band: frequency at which the window lets half of the amplitude pass [Hz].
            springs: that swing behind these joints, see `known_springs`.
        """
        robot = segments[0].problem.robot
        windows = [[_window(s, j, band) for j in range(robot.n)] for s in segments]
        steps = [beside_springs(TorqueSteps.of(s), springs) for s in segments]
        gains = [
            part.columns([Column(in_steps=by) for by in np.moveaxis(part.segment.signals.response, 2, 0)])
            for part in steps
        ]
        found, start = [], np.cumsum([0.0, *(float(np.ptp(s.signals.ticks)) + 10.0 for s in segments)])
        for j, joint in enumerate(robot.joints):
            parts = []
            for i, s in enumerate(segments):
                window, x, layout = windows[i][j], s.signals.x, s.signals.model.layout
                row = int(layout.joint_link[j])
                drive = gains[i][:, row, j] * s.signals.u[:, j]
                parts.append(
                    (
                        start[i] + s.signals.ticks[window.kept] - s.signals.ticks[0],
                        window.averaged(steps[i].missing[:, row]),
                        window.averaged(steps[i].base[:, row]),
                        window.averaged(drive),
                        x[window.kept, layout.joint_q[j]],
                        x[window.kept, layout.joint_v[j]],
                    )
                )
            times, missing, base, drive, q, v = (np.concatenate(c) for c in zip(*parts, strict=True))
            slowest = max(_slowest(s, j) for s in segments)
            found.append(TorqueRows(joint, times, missing, base, drive, q, v, slowest))
        prior = DynamicsPrior.of(robot)
        shapes = sum(len(spring.shapes) for spring in springs)
        expected = np.concatenate([-prior.residual((), segments[0].calibration)[0], np.zeros(shapes)])
        sigma = np.concatenate([prior.sigma, np.ones(shapes)])
        signals = [_asked_for(part.segment, part.missing, by) for part, by in zip(steps, gains, strict=True)]
        return TorqueEquations(steps, windows, found, signals, expected, sigma, band)

    @property
    def period(self) -> float:
        """Of the ticks [s]."""
        return float(np.median(np.diff(self.signals[0].ticks)))

    def columns(self, hypothesis: EffectHypothesis) -> list[Array] | None:
        """What each size of a hypothesis adds to the missing torque, shape (m, k) by equation; None for numerics."""
        by_segment = []
        for steps, signals in zip(self.steps, self.signals, strict=True):
            if is_spring(hypothesis):
                by_segment.append(reaction_column(steps, hypothesis))
                continue
            columns = columns_of(hypothesis, signals)
            if not columns or any(c.better_integrator for c in columns):
                return None
            by_segment.append(steps.columns(columns))
        layout = self.steps[0].segment.signals.model.layout
        return [
            np.concatenate(
                [w[j].averaged(c[:, int(layout.joint_link[j])]) for w, c in zip(self.windows, by_segment, strict=True)]
            )
            for j in range(len(self.rows))
        ]


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
