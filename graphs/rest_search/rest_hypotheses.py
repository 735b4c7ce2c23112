# SPDX-License-Identifier: BSD-3-Clause
"""Effects that rests may show, put into the model at their null values; the reason why rests say nothing of others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointscope.graphs.rest_search.rest_fits import RestFit
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis, hypotheses_of
from jointscope.graphs.starts.spring_knots import deflections_of
from jointscope.robots.dynamics.at_rest import AT_ONCE, SLIPPING
from jointscope.robots.effect_kinds.effect import LINK_SIDE
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.effect_kinds.smoothed_reading import SmoothedReading
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.model.robot import Robot

FAST = 1e3  # [s/m, s/rad] no damping is so large beside its own size
NOTHING = "does nothing while nothing moves"


def tried_and_silent(fit: RestFit) -> tuple[list[EffectHypothesis], dict[str, str]]:
    """What a fitted model may lack, with each shape, and the reason why another effect is not tried, by label."""
    tried, silent, robot = [], dict[str, str](), fit.robot
    # where encoders say: a model that lacks a curve bends its own states
    positions = np.zeros((len(fit.x), robot.layout.size))
    positions[:, robot.layout.positions] = fit.rests.start(fit.calibration)[0]
    seen = deflections_of(robot, [fit.rests.model.seen(positions, robot.values)])
    for hypothesis in hypotheses_of(robot, at_rest=True, deflections=seen):
        why = _why_silent(robot, hypothesis)
        if why:
            silent[hypothesis.label] = why
        else:
            tried.append(hypothesis)
    return tried, silent


def batches(hypotheses: Sequence[EffectHypothesis]) -> list[list[EffectHypothesis]]:
    """Parts in which no effect stands twice, with one of its shapes."""
    found: list[list[EffectHypothesis]] = []
    seen: dict[str, int] = {}
    for hypothesis in hypotheses:
        k = seen[hypothesis.label] = seen.get(hypothesis.label, -1) + 1
        if k == len(found):
            found.append([])
        found[k].append(hypothesis)
    return found


def _why_silent(robot: Robot, hypothesis: EffectHypothesis) -> str:
    """Why rests can say nothing of an effect, whatever they are; empty where they may."""
    effect, owner = hypothesis.here.effect, hypothesis.here.owner
    if isinstance(effect, TimeShift | SmoothedReading):
        return NOTHING
    if isinstance(effect, Structure) and effect.form not in ("gravity", "loads"):
        hinges = effect.form in ("bearing", "elasticity")
        return "needs coordinates of its own, which are tried with recordings of motion only" if hinges else NOTHING
    if isinstance(effect, ReadingEffect) and owner.removesuffix(LINK_SIDE) not in robot.joints:
        return "its sensor is not read at rest"
    if isinstance(effect, JointTorque) and effect.memory is not None:
        return "depends on how a joint came to rest, which rests do not show"
    if isinstance(effect, JointTorque) and effect.side == "link" and _is_dry(effect, hypothesis):
        return "would hold a link away from equilibrium, at which rests take all links"
    return ""


def _is_dry(effect: JointTorque, hypothesis: EffectHypothesis) -> bool:
    """Whether a torque of the link remains when its velocity goes to zero, but not at zero."""
    sizes = {p.name: p.start for p in hypothesis.sizes} | dict(hypothesis.shapes)
    still = replace(JointSignals(*np.zeros((6, 1))), sharpness=AT_ONCE)
    slow = replace(still, v_link=np.full(1, SLIPPING))
    return bool(abs(effect.law(slow, sizes)[0] - effect.law(still, sizes)[0]) > SLIPPING * FAST)
