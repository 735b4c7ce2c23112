# SPDX-License-Identifier: BSD-3-Clause
"""Column of a rigid joint that becomes elastic."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.column import SensorColumn, SensorPart
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.robots.effect_kinds.effect_at import EffectAt

Array = NDArray[np.float64]


def elasticity_column(here: EffectAt, s: ScoreSignals) -> SensorColumn:
    """A rigid joint that becomes elastic: the motor runs ahead of the link by compliance times transmitted torque."""
    layout, tree, j = s.model.layout, s.robot.kinematic_tree, s.robot.joints.index(here.owner)
    torque = tree.torque(s.x[:, layout.q_link], s.x[:, layout.v_link], s.a_link)[:, layout.joint_link[j]]

    def column(part: SensorPart) -> Array:
        error = np.zeros(part.reading.shape)
        if part.name == s.robot.motor_encoder.name:
            error[:, part.channels == j] = np.interp(part.stamps, s.ticks, torque)[:, None]
        return error

    return column
