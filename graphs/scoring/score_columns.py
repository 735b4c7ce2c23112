# SPDX-License-Identifier: BSD-3-Clause
"""Regressors of hypotheses: how residuals change with each size of an effect at its null value.

At null a law's torque is zero for every motion, so only its derivative by its sizes matters, evaluated along the
smoothed motion. Effects act in three ways: accelerations at the ticks, accelerations held over each step (commands),
and errors of readings. A soft bearing is scored through its compliance: the tilt is compliance times reaction torque,
passed through a resonance; gyros see its rate, the joints its inertia. How each kind of effect makes its columns is in
`graphs/scoring/columns/`.
"""

from __future__ import annotations

from dataclasses import replace

from jointscope.graphs.scoring.columns.bearing import bearing_columns
from jointscope.graphs.scoring.columns.column import Column
from jointscope.graphs.scoring.columns.command import command_columns
from jointscope.graphs.scoring.columns.elasticity import elasticity_column
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.inertia import axis_columns, coriolis_columns, gravity_columns, inertia_columns
from jointscope.graphs.scoring.columns.joint_torque import joint_torque_columns
from jointscope.graphs.scoring.columns.play import play_column
from jointscope.graphs.scoring.columns.reading import late_column, reading_column, smooth_column
from jointscope.graphs.scoring.columns.robot_torque import robot_torque_columns
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.graphs.scoring.columns.transmission import transmission_columns
from jointscope.graphs.scoring.score_system import Segment
from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect
from jointscope.robots.effect_kinds.joint_torque import JointTorque
from jointscope.robots.effect_kinds.lagging_reading import LaggingReading
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.effect_kinds.robot_torque import RobotTorque
from jointscope.robots.effect_kinds.smoothed_reading import SmoothedReading
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.effect_kinds.transmission_elements import TransmissionElements


def regressors_of(hypothesis: EffectHypothesis, segment: Segment) -> list[Column]:
    """One column for each size of a hypothesis, looked at wherever the rule of integration looks."""
    found = columns_of(hypothesis, segment.signals)
    if follows_commands(hypothesis):
        ends = columns_of(hypothesis, segment.ends)
        found = [replace(column, at_ends=end.at_ticks) for column, end in zip(found, ends, strict=True)]
    if segment.middle is None or all(column.at_ticks is None for column in found):
        return found
    between = columns_of(hypothesis, segment.middle[0])
    return [replace(column, between=b.at_ticks) for column, b in zip(found, between, strict=True)]


def follows_commands(hypothesis: EffectHypothesis) -> bool:
    """Whether a column at the ticks contains accelerations, which jump there with the commands.

    A step that ended with the acceleration of the next one was as one with a delay of half a sample: at 250 Hz 1 % of
    the column of a mass, enough to tell what scales with the torque constant from it.
    """
    effect = hypothesis.here.effect
    turned = isinstance(effect, Structure) and effect.form == "axis"
    return turned or isinstance(effect, InertiaEffect | TransmissionElements)


def columns_of(hypothesis: EffectHypothesis, s: ScoreSignals) -> list[Column]:
    """One column for each size of a hypothesis."""
    effect = hypothesis.here.effect
    if isinstance(effect, JointTorque):
        return joint_torque_columns(hypothesis, s)
    if isinstance(effect, RobotTorque):
        return robot_torque_columns(hypothesis, s)
    if isinstance(effect, TransmissionElements):
        return transmission_columns(hypothesis, s)
    if isinstance(effect, CommandEffect):
        return command_columns(hypothesis, s)
    if isinstance(effect, InertiaEffect):
        return inertia_columns(hypothesis, s)
    if isinstance(effect, ReadingEffect):
        return [Column(reading=reading_column(hypothesis, s, p.name)) for p in hypothesis.sizes]
    if isinstance(effect, LaggingReading):
        return [Column(reading=play_column(hypothesis, s))]
    if isinstance(effect, TimeShift):
        return [Column(reading=late_column(hypothesis, s, p.name)) for p in hypothesis.sizes]
    if isinstance(effect, SmoothedReading):
        return [Column(reading=smooth_column(hypothesis, s))]
    assert isinstance(effect, Structure)
    if effect.form == "bearing":
        return bearing_columns(hypothesis, s)
    if effect.form == "integration":
        return [Column(better_integrator=True)]
    if effect.form == "coriolis":
        return coriolis_columns(s)
    if effect.form == "gravity":
        return gravity_columns(s)
    if effect.form == "axis":
        return axis_columns(hypothesis, s)
    return [Column(reading=elasticity_column(hypothesis.here, s))] if effect.form == "elasticity" else []
