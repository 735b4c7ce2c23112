# SPDX-License-Identifier: BSD-3-Clause
"""Columns of changes of the command, which are held over each step."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.scoring.columns.column import Column, null_values
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.robots.effect_kinds.command_effect import CommandEffect


def command_columns(hypothesis: EffectHypothesis, s: ScoreSignals) -> list[Column]:
    """One column of accelerations held over the steps for each size."""
    effect, joints = hypothesis.here.effect, s.robot.joints
    assert isinstance(effect, CommandEffect)
    chosen = range(len(joints)) if hypothesis.here.owner == "robot" else (joints.index(hypothesis.here.owner),)
    total = {size.name: np.zeros(s.response.shape[:2]) for size in hypothesis.sizes}
    for j in chosen:
        _, slopes = effect.law(s.ticks, s.u[:, j], null_values(hypothesis))
        for name, slope in slopes.items():
            if name in total:
                total[name] += s.response[:, :, j] * slope[:, None]
    return [Column(in_steps=total[size.name]) for size in hypothesis.sizes]
