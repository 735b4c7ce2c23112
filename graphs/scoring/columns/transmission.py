# SPDX-License-Identifier: BSD-3-Clause
"""Columns of elements of the transmission's matrix: the equations' own derivatives, with the effect added at null."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointscope.graphs.scoring.columns.column import Column
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.files.effect_editing import parameter_of


def transmission_columns(hypothesis: EffectHypothesis, s: ScoreSignals) -> list[Column]:
    """One column of accelerations for each size."""
    here = hypothesis.here
    sizes = {here.parameter(p.name): parameter_of(here, p, p.null) for p in hypothesis.sizes}
    robot = replace(s.robot, effects=(*s.robot.effects, here), parameters={**s.robot.parameters, **sizes})
    model = ElasticJoints(robot)
    by_name = dict(zip(s.model.names, s.parameters.tolist(), strict=True))
    parameters = np.array([by_name.get(name, 0.0) for name in model.names])
    torques = model.torques(s.x, np.vstack([s.u, s.u[-1:]]), parameters).by_parameter
    assert torques is not None
    return [Column(at_ticks=s.accelerations(torques[:, :, model.names.index(name)])) for name in sizes]
