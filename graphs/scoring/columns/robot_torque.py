# SPDX-License-Identifier: BSD-3-Clause
"""Columns of torques on several joints."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.scoring.columns.column import STEP, Column, null_values
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.robots.effect_kinds.robot_torque import RobotSignals, RobotTorque


def robot_torque_columns(hypothesis: EffectHypothesis, s: ScoreSignals) -> list[Column]:
    """One column of accelerations for each size."""
    effect, layout, joints = hypothesis.here.effect, s.model.layout, s.robot.joints
    assert isinstance(effect, RobotTorque)
    signals = RobotSignals(
        q_link=s.seen[:, layout.joint_q],
        v_link=s.seen[:, layout.joint_v],
        q_motor=s.seen[:, layout.motor_q],
        v_motor=s.seen[:, layout.motor_v],
        stiffness=s.stiffness,
        damping=s.damping,
        joints=joints,
        owner=joints.index(hypothesis.here.owner) if hypothesis.here.owner in joints else 0,
        sharpness=s.robot.friction_sharpness(),
    )
    p, found = null_values(hypothesis), []
    for size in hypothesis.sizes:
        link, motor = effect.law(signals, {**p, size.name: p[size.name] + 1j * STEP})
        tau = np.zeros((len(s.ticks), layout.n_rates))
        for j in range(len(joints)):
            tau[:, layout.joint_link[j]] += np.imag(link)[:, j] / STEP
            tau[:, layout.motor_row[j]] += np.imag(motor)[:, j] / STEP
        found.append(Column(at_ticks=s.accelerations(s.in_equations(tau, hypothesis.here))))
    return found
