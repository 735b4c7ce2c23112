# SPDX-License-Identifier: BSD-3-Clause
"""Columns of torques of one joint, memories included."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.column import STEP, Column, null_values
from jointscope.graphs.scoring.columns.gap import curves_of, torque_beyond, tried_gap
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.robots.dynamics.transmission import is_behind
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque

Array = NDArray[np.float64]


def joint_torque_columns(hypothesis: EffectHypothesis, s: ScoreSignals) -> list[Column]:
    """One column of accelerations for each size."""
    effect, layout = hypothesis.here.effect, s.model.layout
    assert isinstance(effect, JointTorque)
    j = s.robot.joints.index(hypothesis.here.owner)
    x = s.seen if is_behind(hypothesis.here, s.robot) else s.x
    signals = joint_signals(s, j, x)
    gap = effect.behind(s.robot.effects, hypothesis.here.owner)
    signals = replace(signals, gap=tuple(s.values[name] for name in gap)) if gap else signals
    if effect.load == "weight":
        signals = replace(signals, tau_spring=s.weight[:, j])
    p = null_values(hypothesis)
    if effect.memory is not None:
        signals = signals_with_memory(effect, signals, p, s.ticks)
    link = int(layout.joint_link[j])
    motor = int(layout.motor_row[j])
    rows = {"link": ((link, 1.0),), "motor": ((motor, 1.0),), "spring": ((link, -1.0), (motor, 1.0))}[effect.side]
    found = []
    for size in hypothesis.sizes:
        if tried := tried_gap(effect, hypothesis):
            slope = torque_beyond(signals, size.name, tried)
        else:
            slope = np.imag(effect.law(signals, {**p, size.name: p[size.name] + 1j * STEP})) / STEP
        if size.name in effect.gap:
            moved = tuple(1j * STEP * (name == size.name) for name in effect.gap)
            slope = slope + _of_curves(hypothesis, s, replace(signals, gap=moved))
        tau = np.zeros((len(s.ticks), layout.n_rates))
        for row, sign in rows:
            tau[:, row] = sign * slope
        found.append(Column(at_ticks=s.accelerations(s.in_equations(tau, hypothesis.here))))
    return found


def _of_curves(hypothesis: EffectHypothesis, s: ScoreSignals, signals: JointSignals) -> Array:
    """What a gap, moved by an imaginary step, does to laws that would lie beyond it, shape (m + 1,)."""
    change = np.zeros(len(s.ticks))
    for here in curves_of(s.robot, hypothesis.here):
        assert isinstance(here.effect, JointTorque)
        change += np.imag(here.effect.law(signals, here.own(s.values))) / STEP
    return change


def joint_signals(s: ScoreSignals, j: int, x: Array) -> JointSignals:
    """Motion of one joint, of the states x or of those seen through the transmission, shape (m + 1, d)."""
    layout = s.model.layout
    return JointSignals(
        q_link=x[:, layout.joint_q[j]],
        v_link=x[:, layout.joint_v[j]],
        q_motor=x[:, layout.motor_q[j]],
        v_motor=x[:, layout.motor_v[j]],
        tau_spring=s.tau_spring[:, j],
        stiffness=float(s.stiffness[j]),
        sharpness=s.robot.sharpness_of(s.robot.joints[j]),
    )


def signals_with_memory(effect: JointTorque, signals: JointSignals, p: dict[str, float], ticks: Array) -> JointSignals:
    """The same with the effect's memory integrated along the motion, by linearly implicit steps.

    Each step takes dz/dt = f(z) as f(z_k) + f'(z_k) (z - z_k) and solves that exactly; for rates that are linear in z
    between kinks of the motion nothing else is needed.
    """
    from jointscope.graphs.kernels.implicit_steps import implicit_steps  # numba takes half a second to import

    assert effect.memory is not None
    rate, h = effect.memory.rate, np.diff(ticks)
    at = [np.broadcast_to(np.real(rate(replace(signals, memory=z), p)), ticks.shape) for z in (0.0, 1.0, -1.0)]
    constant, slope, bend = at[0], 0.5 * (at[1] - at[2]), 0.5 * (at[1] + at[2]) - at[0]
    constant, slope, bend = (0.5 * (part[1:] + part[:-1]) for part in (constant, slope, bend))
    return replace(signals, memory=implicit_steps(h, constant, slope, bend))
