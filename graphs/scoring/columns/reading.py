# SPDX-License-Identifier: BSD-3-Clause
"""Columns of errors of readings: distorted and smoothed values, and late stamps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.column import STEP, SensorColumn, SensorPart, null_values
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.robots.effect_kinds.effect import LINK_SIDE
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.model.lateness import shifts, smooths

Array = NDArray[np.float64]


def reading_column(hypothesis: EffectHypothesis, s: ScoreSignals, size: str) -> SensorColumn:
    """Error of the owner's readings for one size."""
    effect, owner = hypothesis.here.effect, hypothesis.here.owner
    assert isinstance(effect, ReadingEffect)
    p = null_values(hypothesis)
    moved = {**p, size: p[size] + 1j * STEP}
    sides = {s.robot.motor_encoder.name: s.robot.joints}
    if s.robot.link_encoder is not None:
        sides[s.robot.link_encoder.name] = tuple(f"{joint}{LINK_SIDE}" for joint in s.robot.joints)

    def column(part: SensorPart) -> Array:
        error: Array = np.zeros(part.reading.shape)
        if part.name == owner:
            every = np.zeros((len(part.stamps), len(s.robot.sensors[owner].channels)))
            every[:, part.channels] = part.reading
            error[:] = (np.imag(effect.law(every, part.stamps, moved)) / STEP)[:, part.channels]
        elif owner in sides.get(part.name, ()):
            row = np.flatnonzero(part.channels == sides[part.name].index(owner))
            if len(row):
                error[:, row] = np.imag(effect.law(part.reading[:, row], part.stamps, moved)) / STEP
        return error

    return column


def late_column(hypothesis: EffectHypothesis, s: ScoreSignals, size: str) -> SensorColumn:
    """Error of readings whose stamps are late, for one size."""
    effect = hypothesis.here.effect
    assert isinstance(effect, TimeShift)
    p = null_values(hypothesis)

    def column(part: SensorPart) -> Array:
        slope = effect.late(part.stamps, p)[1][size]
        hit = np.array([shifts(hypothesis.here, s.robot, part.name, int(channel)) for channel in part.channels])
        return -part.reading_rate * slope[:, None] * hit

    return column


def smooth_column(hypothesis: EffectHypothesis, s: ScoreSignals) -> SensorColumn:
    """Error of readings that a filter has smoothed, by the variance of its weights."""

    def column(part: SensorPart) -> Array:
        hit = np.array([smooths(hypothesis.here, s.robot, part.name, int(channel)) for channel in part.channels])
        return 0.5 * part.reading_bend * hit

    return column
