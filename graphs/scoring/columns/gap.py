# SPDX-License-Identifier: BSD-3-Clause
"""A dead zone in front of a spring that has a curve of its own.

The curve's free terms bend until they look like the dead zone, and its derivative at null, the slope of that curve, has
nothing left to explain. What a polynomial cannot follow is the corner: so the torques of a spring and of a damper that
begin beyond a gap are tried, for gaps on a grid over the deflections that occur.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.robots.effect_kinds.effect import EffectParameter
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, beyond_gap, within_gap
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import cannot_be_added
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

TRIED = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)  # of the largest deflection
BEYOND = ("stiffness", "damping")  # sizes of such a hypothesis: of the spring and of the damper beyond the gap


def gap_hypotheses(segments: Sequence[ScoreSignals]) -> list[EffectHypothesis]:
    """Hypotheses of gaps that the curve of a spring may hide."""
    robot, found = segments[0].robot, []
    for effect in catalogue().values():
        if not isinstance(effect, JointTorque) or not effect.gap:
            continue
        for owner in effect.owners_of(robot):
            here = EffectAt(effect, owner)
            if robot.has_effect(effect.id, owner) or cannot_be_added(robot, here) or not curves_of(robot, here):
                continue
            if any(f"{owner}.{name}" not in robot.parameters for name in BEYOND):
                continue  # a spring that came as an effect has a compliance: its gap is scored at null alone
            j = robot.joints.index(owner)
            largest = max(float(np.max(np.abs(deflection(s, j)))) for s in segments)
            known = [robot.parameters[f"{owner}.{name}"] for name in BEYOND]
            sizes = tuple(
                EffectParameter(name, p.unit, p.prior, p.prior_sigma or p.prior, sign="+")
                for name, p in zip(BEYOND, known, strict=True)
            )
            none = dict.fromkeys(effect.gap, 0.0)
            tried = [none | {end: share * largest} for end in effect.gap for share in TRIED]
            found += [EffectHypothesis(here, sizes, gap) for gap in tried]
    return found


def tried_gap(effect: JointTorque, hypothesis: EffectHypothesis) -> tuple[float, ...]:
    """The dead zone that a hypothesis tries, as `beyond_gap` takes it; empty for one that is scored at null."""
    return tuple(hypothesis.shapes[name] for name in effect.gap if name in hypothesis.shapes)


def torque_beyond(signals: JointSignals, name: str, gap: Sequence[float]) -> Array:
    """Torque of a spring or a damper that begins beyond a gap, by its stiffness or its damping, shape (m + 1,)."""
    if name == BEYOND[0]:
        return np.asarray(beyond_gap(signals.deflection, *gap))
    return np.asarray(signals.deflection_rate * (1.0 - within_gap(signals.deflection, *gap)))


def curves_of(robot: Robot, gap: EffectAt) -> list[EffectAt]:
    """Laws of the spring that would lie beyond a gap and have something to bend."""
    found = []
    for here in robot.effects:
        if here.owner == gap.owner and isinstance(here.effect, JointTorque) and here.effect.memory is None:
            names = [here.parameter(p.name) for p in here.effect.parameters]
            if here.effect.behind((gap,), here.owner) and any(not robot.parameters[name].fixed for name in names):
                found.append(here)
    return found


def deflection(s: ScoreSignals, j: int) -> Array:
    """What the spring of a joint sees, shape (m + 1,)."""
    layout = s.model.layout
    return np.asarray(s.seen[:, layout.joint_q[j]] - s.seen[:, layout.motor_q[j]])
