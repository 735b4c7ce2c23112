# SPDX-License-Identifier: BSD-3-Clause
"""Columns of elements of the transmission's matrix: the equations' own derivatives, with the effect added at null."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointscope.graphs.scoring.columns.column import Column
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.graphs.solving.normal_equations import CHUNK
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
    u, tau = np.vstack([s.u, s.u[-1:]]), {name: np.zeros((len(s.ticks), model.layout.n_rates)) for name in sizes}
    for start in range(0, len(s.ticks), CHUNK):
        part = slice(start, start + CHUNK)
        torques = model.torques(s.x[part], u[part], parameters).by_parameter
        assert torques is not None
        for name, found in tau.items():
            found[part] = torques[:, :, model.names.index(name)]
    return [Column(at_ticks=s.accelerations(found)) for found in tau.values()]
