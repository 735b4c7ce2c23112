# SPDX-License-Identifier: BSD-3-Clause
"""Columns of the rigid bodies: changed inertias, turned gravity, and Coriolis torques that a model leaves out."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.scoring.columns.column import Column
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect
from jointscope.robots.model.structured_tree import InertiaChange, inertia_torques, tilt_torques


def inertia_columns(hypothesis: EffectHypothesis, s: ScoreSignals) -> list[Column]:
    """One column of accelerations for each size."""
    effect, tree, layout = hypothesis.here.effect, s.robot.kinematic_tree, s.model.layout
    assert isinstance(effect, InertiaEffect)
    joint = tree.model.getJointId(hypothesis.here.owner)
    directions = effect.change(tree.model.inertias[joint].toDynamicParameters())
    q, v = s.x[:, layout.q_link], s.x[:, layout.v_link]
    changes = [InertiaChange(size.name, joint, np.asarray(directions[size.name], float)) for size in hypothesis.sizes]
    found = []
    for torque in inertia_torques(tree, changes, q, v, s.a_link, 1.0):
        tau = np.zeros((len(s.ticks), layout.n_rates))
        tau[:, : layout.n_link] = -torque
        found.append(Column(at_ticks=s.accelerations(tau)))
    return found


def coriolis_columns(s: ScoreSignals) -> list[Column]:
    """Accelerations by the terms that the model leaves out."""
    layout, tree = s.model.layout, s.robot.kinematic_tree.with_coriolis(True)
    q, v = s.x[:, layout.q_link], s.x[:, layout.v_link]
    still = np.zeros_like(v)
    tau = np.zeros((len(s.ticks), layout.n_rates))
    tau[:, : layout.n_link] = tree.torque(q, still, still) - tree.torque(q, v, still)
    return [Column(at_ticks=s.accelerations(tau))]


def gravity_columns(s: ScoreSignals) -> list[Column]:
    """Accelerations by each tilt of gravity."""
    layout, tree = s.model.layout, s.robot.kinematic_tree
    found = []
    for torque in tilt_torques(tree, tree, s.x[:, layout.q_link], np.zeros(2)):
        tau = np.zeros((len(s.ticks), layout.n_rates))
        tau[:, : layout.n_link] = -torque
        found.append(Column(at_ticks=s.accelerations(tau)))
    return found
