# SPDX-License-Identifier: BSD-3-Clause
"""Column of a play of an encoder: which end of it pushes, followed along the smoothed motion.

At null a play has no width, and its derivative jumps from one end to the other where the joint turns round, which the
noise of a joint that rests does all the time. So a play of a small width is followed. What was smoothed without it is
about what the encoder read: the width that the reading lost already has not to be lost again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.column import SensorColumn, SensorPart
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.robots.effect_kinds.effect import LINK_SIDE
from jointscope.robots.effect_kinds.lagging_reading import LaggingReading

Array = NDArray[np.float64]

FOLLOWED = 2.0  # [sigma of the encoder] half of the play that is followed


def play_column(hypothesis: EffectHypothesis, s: ScoreSignals) -> SensorColumn:
    """Error of the owner's readings for half of its play."""
    effect, owner, robot = hypothesis.here.effect, hypothesis.here.owner, s.robot
    assert isinstance(effect, LaggingReading)
    on_link = owner.endswith(LINK_SIDE)
    j, encoder = robot.joints.index(owner.removesuffix(LINK_SIDE)), robot.link_encoder if on_link else None
    name = (encoder or robot.motor_encoder).name
    q = s.x[:, (s.model.layout.joint_q if on_link else s.model.layout.motor_q)[j]]
    pushed = pushed_end(q, FOLLOWED * effect.noise_of(robot, owner))

    def column(part: SensorPart) -> Array:
        error: Array = np.zeros(part.reading.shape)
        if part.name == name:
            error[:, part.channels == j] = -np.interp(part.stamps, s.ticks, pushed)[:, None]
        return error

    return column


def pushed_end(q: Array, half: float) -> Array:
    """Where in its play a sensor is: 1 where it is pushed upwards, -1 downwards, between them on the way, shape (m,).

    Args:
        q: positions that follow each other, shape (m,) [rad].
        half: of the play [rad].
    """
    lag, found = 0.0, np.empty(len(q))
    for k, moved in enumerate(np.diff(q, prepend=q[:1]).tolist()):
        lag = min(max(lag + moved, -half), half)
        found[k] = lag
    return found / half
