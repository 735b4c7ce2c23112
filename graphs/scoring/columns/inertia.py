# SPDX-License-Identifier: BSD-3-Clause
"""Columns of the rigid bodies: changed inertias, turned gravity and axes, and Coriolis torques that are left out."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.column import Column
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect
from jointscope.robots.model.structured_tree import InertiaChange, inertia_torques, tilt_torques
from jointscope.robots.model.turned_axes import TurnedAxis, turn_torques

Array = NDArray[np.float64]


def inertia_columns(hypothesis: EffectHypothesis, s: ScoreSignals) -> list[Column]:
    """One column of accelerations for each size."""
    effect, tree, layout = hypothesis.here.effect, s.robot.kinematic_tree, s.model.layout
    assert isinstance(effect, InertiaEffect)
    owner = hypothesis.here.owner
    joint = tree.model.getJointId(effect.joint_of(s.robot, owner))
    directions = effect.change_at(s.robot, owner, tree.model.inertias[joint].toDynamicParameters())
    q, v = s.x[:, layout.q_link], s.x[:, layout.v_link]
    changes = [InertiaChange(size.name, joint, np.asarray(directions[size.name], float)) for size in hypothesis.sizes]
    return _against(inertia_torques(tree, changes, q, v, s.a_link, 1.0), s)


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
    tree = s.robot.kinematic_tree
    return _against(tilt_torques(tree, tree, s.x[:, s.model.layout.q_link], np.zeros(2)), s)


def axis_columns(hypothesis: EffectHypothesis, s: ScoreSignals) -> list[Column]:
    """Accelerations by each turn of an axis."""
    tree, layout = s.robot.kinematic_tree, s.model.layout
    names = tuple(size.name for size in hypothesis.sizes)
    axis = TurnedAxis(names, tree.model.getJointId(hypothesis.here.owner))
    motion = (s.x[:, layout.q_link], s.x[:, layout.v_link], s.a_link)
    return _against(turn_torques(tree, axis, motion), s)


def _against(torques: Iterable[Array], s: ScoreSignals) -> list[Column]:
    """Accelerations where the links must bring up some torques, shape (m, n_link) each [N m]."""
    found, layout = [], s.model.layout
    for torque in torques:
        tau = np.zeros((len(s.ticks), layout.n_rates))
        tau[:, : layout.n_link] = -torque
        found.append(Column(at_ticks=s.accelerations(tau)))
    return found
