# SPDX-License-Identifier: BSD-3-Clause
r"""Joints whose encoder counts from another zero than the URDF, by regression of all joints together.

With an encoder at joint k that reads an angle o too much, all torques are those of another posture,

    tau(q - o e_k, v, a) = tau(q, v, a) + o s(q, v, a),        s = (tau(q - o e_k, v, a) - tau(q, v, a)) / o

so the secant s is a column that the joints share, and o its size. That is how weights behind a joint look that are
turned about its axis; one size tells it where a mass at another place has four. Beginning at the slope, the secant is
taken at the angle found.
"""

from __future__ import annotations

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.regression.joint_regression import JointRows
from jointscope.graphs.scoring.regression.shared_columns import Told, told_of
from jointscope.graphs.scoring.regression.torque_columns import ANGLE, TURN
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import cannot_be_added

ROUNDS = 2  # in which the secant follows the angle
FAR = 0.01  # [rad] from which a secant is another one than the slope
MOST = 0.8  # [rad] of an angle: beyond, another posture is another arm


def turned_joints(rows: JointRows, widths: list[float]) -> list[Told]:
    """What windows of each width [s] say of another zero of each joint that turns.

    Args:
        rows: of the regression.
        widths: of windows.
    """
    robot, effect, found = rows.robot, catalogue()[TURN], list[Told]()
    for joint in robot.joints:
        here = EffectAt(effect, joint)
        if joint in robot.tree.slides or robot.has_effect(TURN, joint) or cannot_be_added(robot, here):
            continue
        parameters = effect.parameters_at(robot, joint)
        some = _of(rows, EffectHypothesis(here, parameters), widths)
        for _ in range(ROUNDS):
            best = max(some, key=lambda one: one.evidence, default=None)
            if best is None or best.evidence <= 0.0 or not FAR < abs(best.found[0]) < MOST:
                break
            some = _of(rows, EffectHypothesis(here, parameters, {ANGLE: float(best.found[0])}), widths)
        found += [one for one in some if abs(one.found[0]) < MOST]
    return found


def _of(rows: JointRows, turn: EffectHypothesis, widths: list[float]) -> list[Told]:
    return [one for width in widths for one in told_of(rows, turn, width, (1,))]
