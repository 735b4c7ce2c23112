# SPDX-License-Identifier: BSD-3-Clause
"""Shapes to try, from the motion itself: speeds of its own range, waves that its stroke holds several times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby, product

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.judging.elastic_reaction import is_spring, spring_hypotheses
from jointscope.graphs.judging.torque_noise import speeds
from jointscope.graphs.judging.torque_rows import TorqueEquations, TorqueRows
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis, hypotheses_of
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

FEWEST_PERIODS = 3.0  # in the stroke: fewer are an offset with a bend
MOST_PERIODS = 60.0
STEP = 0.5  # [periods in the stroke]


def hypotheses_on_motion(robot: Robot, equations: TorqueEquations) -> list[EffectHypothesis]:
    """The catalogue with shapes on grids from the motion; those of one effect and owner stand together."""
    own = {r.joint: r for r in equations.rows}
    found = []
    for _, group in groupby(hypotheses_of(robot), key=lambda h: h.label):
        alike = list(group)
        if is_spring(alike[0]):
            found += spring_hypotheses(alike[0].here, equations.period)
            continue
        grids = _grids(alike, own[alike[0].here.owner], robot) if alike[0].here.owner in own else {}
        if grids:
            names, values = list(grids), product(*grids.values())
            found += [replace(alike[0], shapes=dict(zip(names, map(float, v), strict=True))) for v in values]
        else:
            found += alike
    return found


def _grids(alike: Sequence[EffectHypothesis], rows: TorqueRows, robot: Robot) -> Mapping[str, Array]:
    here, grids = alike[0].here, dict[str, Array]()
    for p in here.effect.parameters_at(robot, here.owner):
        if p.name not in alike[0].shapes:
            continue
        if p.unit in ("rad/s", "m/s"):
            grids[p.name] = speeds(rows)
        elif p.name == "order":
            period = np.arange(FEWEST_PERIODS, MOST_PERIODS, STEP)
            grids[p.name] = 2.0 * np.pi * period / max(float(np.ptp(rows.q)), 1e-9)
        else:
            grids[p.name] = np.array(sorted({h.shapes[p.name] for h in alike}))
    return grids
