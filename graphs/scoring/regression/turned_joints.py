# SPDX-License-Identifier: BSD-3-Clause
r"""Joints whose encoder counts from another zero than the URDF, by regression of all joints together.

With an encoder at joint k that reads an angle o too much, all torques are those of another posture,

    tau(q - o e_k, v, a) = tau(q, v, a) + o s(q, v, a),        s = (tau(q - o e_k, v, a) - tau(q, v, a)) / o

so the secant s is a column that the joints share, and o its size. That is how weights behind a joint look that are
turned about its axis; one size tells it where a mass at another place has four. Beginning at the slope, the secant is
taken at the angle found. Zeros may be wrong at several joints at once, as after a homing that went wrong: to the joint
that tells most the one is added that tells most beside it, and so on while that becomes more plausible and explains
most of what was left at some joint: a fine encoder has evidence for the smallest defects of a regression.
"""

from __future__ import annotations

from dataclasses import replace

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.regression.joint_regression import JointRows
from jointscope.graphs.scoring.regression.shared_columns import Told, told_of
from jointscope.graphs.scoring.regression.torque_columns import ANGLE, TURN
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import cannot_be_added

ROUNDS = 2  # in which the secant follows the angle
FAR = 0.01  # [rad] from which a secant is another one than the slope
LEFT = 0.5  # of the mean square that is left at some joint, which another zero may leave of it
MOST = 0.8  # [rad] of an angle: beyond, another posture is another arm


def turned_joints(rows: JointRows, widths: list[float]) -> list[Told]:
    """What windows of each width [s] say of another zero of each joint that turns, and of those of several.

    Args:
        rows: of the regression.
        widths: of windows.
    """
    robot, effect, asked = rows.robot, catalogue()[TURN], list[EffectHypothesis]()
    for joint in robot.joints:
        here = EffectAt(effect, joint)
        if joint in robot.tree.slides or robot.has_effect(TURN, joint) or cannot_be_added(robot, here):
            continue
        asked.append(EffectHypothesis(here, effect.parameters_at(robot, joint)))
    found = [one for turn in asked for one in _at_angles(rows, (turn,), widths)]
    best = max(found, key=_evidence, default=None)
    while best is not None and best.evidence > 0.0:
        known = {turn.here.owner for turn in best.together}
        more = [one for turn in asked if turn.here.owner not in known for one in _beside(rows, best, turn, widths)]
        clearer = max(more, key=_evidence, default=None)
        best = clearer if clearer is not None and _explains_more(clearer, best) else None
        found += [best] if best is not None else []
    return found


def _explains_more(told: Told, before: Told) -> bool:
    """Whether one zero more is more plausible, and explains most of what is left at some joint."""
    shares = [
        {here.joint: left / here.plain for here, left in zip(one.some, one.left, strict=True)} for one in (told, before)
    ]
    fallen = [share / shares[1].get(joint, 1.0) for joint, share in shares[0].items()]
    return told.evidence > before.evidence and min(fallen) < LEFT


def _beside(rows: JointRows, best: Told, turn: EffectHypothesis, widths: list[float]) -> list[Told]:
    return _at_angles(rows, (*best.together, turn), widths)


def _at_angles(rows: JointRows, turns: tuple[EffectHypothesis, ...], widths: list[float]) -> list[Told]:
    """The same with secants at the angles found, of each width."""
    some = _of(rows, turns, widths)
    for _ in range(ROUNDS):
        best = max(some, key=_evidence, default=None)
        if best is None or best.evidence <= 0.0 or not FAR < max(abs(best.found)) < MOST:
            break
        turns = tuple(
            replace(turn, shapes={ANGLE: float(angle)} if abs(angle) > FAR else {})
            for turn, angle in zip(turns, best.found, strict=True)
        )
        some = _of(rows, turns, widths)
    return [one for one in some if max(abs(one.found)) < MOST]


def _of(rows: JointRows, turns: tuple[EffectHypothesis, ...], widths: list[float]) -> list[Told]:
    first, beside = turns[0], turns[1:]
    return [one for width in widths for one in told_of(rows, first, width, (len(turns),), beside)]


def _evidence(told: Told) -> float:
    return told.evidence
