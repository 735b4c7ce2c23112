# SPDX-License-Identifier: BSD-3-Clause
"""Columns of the rigid bodies: changed inertias, and Coriolis torques that a model leaves out."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.columns.column import Column
from jointscope.graphs.trial_signals import TrialSignals
from jointscope.graphs.trials import Trial
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect
from jointscope.robots.structured_tree import InertiaChange, inertia_about_joint, inertia_torque


def inertia_columns(trial: Trial, s: TrialSignals) -> list[Column]:
    """One column of accelerations for each size."""
    effect, tree, layout = trial.here.effect, s.robot.kinematic_tree, s.model.layout
    assert isinstance(effect, InertiaEffect)
    joint = tree.model.getJointId(trial.here.owner)
    directions = effect.change(inertia_about_joint(tree.model, joint))
    q, v = s.x[:, layout.q_link], s.x[:, layout.v_link]
    found = []
    for size in trial.sizes:
        change = InertiaChange(size.name, joint, np.asarray(directions[size.name], float))
        tau = np.zeros((len(s.ticks), layout.n_rates))
        tau[:, : layout.n_link] = -inertia_torque(tree, change, q, v, s.a_link, 1.0)
        found.append(Column(at_ticks=s.accelerations(tau)))
    return found


def coriolis_columns(s: TrialSignals) -> list[Column]:
    """Accelerations by the terms that the model leaves out."""
    layout, tree = s.model.layout, s.robot.kinematic_tree.with_coriolis(True)
    q, v = s.x[:, layout.q_link], s.x[:, layout.v_link]
    still = np.zeros_like(v)
    tau = np.zeros((len(s.ticks), layout.n_rates))
    tau[:, : layout.n_link] = tree.torque(q, still, still) - tree.torque(q, v, still)
    return [Column(at_ticks=s.accelerations(tau))]
