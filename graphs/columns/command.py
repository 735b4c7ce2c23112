# SPDX-License-Identifier: BSD-3-Clause
"""Columns of changes of the command, which are held over each step."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.columns.column import Column, null_values
from jointscope.graphs.trial_signals import TrialSignals
from jointscope.graphs.trials import Trial
from jointscope.robots.effect_kinds.command_effect import CommandEffect


def command_columns(trial: Trial, s: TrialSignals) -> list[Column]:
    """One column of accelerations held over the steps for each size."""
    effect, joints = trial.here.effect, s.robot.joints
    assert isinstance(effect, CommandEffect)
    chosen = range(len(joints)) if trial.here.owner == "robot" else (joints.index(trial.here.owner),)
    total = {size.name: np.zeros(s.response.shape[:2]) for size in trial.sizes}
    for j in chosen:
        _, slopes = effect.law(s.ticks, s.u[:, j], null_values(trial))
        for name, slope in slopes.items():
            if name in total:
                total[name] += s.response[:, :, j] * slope[:, None]
    return [Column(in_steps=total[size.name]) for size in trial.sizes]
