# SPDX-License-Identifier: BSD-3-Clause
"""What joints lack that a regression does not explain: the one reason that explains it, where there is one.

A base that is not level, a load that changes, a push and a cable look alike in a share that is left open; in the
regression each has columns of its own.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis, hypotheses_of
from jointscope.graphs.scoring.regression.asked_by_regression import most_plausible
from jointscope.graphs.scoring.regression.changed_load import LEFT
from jointscope.graphs.scoring.regression.joint_regression import JointRows, fit, joint_rows
from jointscope.graphs.scoring.regression.regressed_causes import regressed_causes
from jointscope.graphs.scoring.regression.ripples import EFFECT as RIPPLE
from jointscope.graphs.starts.windowed_sums import WIDTHS
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

TILT = "gravity_direction"
NOTHING = "names, units, signs, gravity or masses are wrong there, or a spring is missing; look at it first"


def what_is_missing(robot: Robot, recording: Recording, poor: Sequence[str]) -> str:
    """What may be wrong at joints that the regression does not explain, with what to do about it.

    Args:
        robot: as its file has been written.
        recording: from which it was.
        poor: names of the joints.
    """
    rows = joint_rows(robot, [recording])
    if rows is None:
        return NOTHING
    found = most_plausible(rows, [recording.path], regressed_causes(rows))
    if (changed := found.changed) is not None:
        what = "something pushes on the arm from outside" if changed.push else "the arm carries something else"
        until = "on" if changed.stop >= changed.end else f"to {changed.stop:.2f} s"
        return (
            f"from {changed.start:.2f} s {until} {what}, {100.0 * changed.size:.2g} % of the drive's torque at "
            f"{changed.joint}; `jointscope calibrate` says how to leave that out"
        )
    if (link := found.link) is not None:
        if link.turn:
            tilt = f", or the base seems not to be level ({TILT}@robot instead)" if link.tilted else ""
            also = "".join(f", and that of {other} {angle:.2g} rad" for other, angle in link.beside)
            return (
                f"the encoder of {link.joint} seems to read {link.turn:.2g} rad too much{also}: jointscope add "
                f"{robot_argument(robot)} {link.label} -o {edited_argument(robot, 'encoder_offset')}{tilt}"
            )
        carries = "weighs" if not link.moments else "has its centre of mass elsewhere and weighs"
        return f"the link that {link.joint} moves {carries} {link.mass:+.2g} kg more than in the URDF: correct it"
    causes = found.causes
    named = [cause for cause in causes if cause.joint in poor]
    if any(cause.effect == RIPPLE for cause in named):
        return "torque repeats with the position there, as from magnets or teeth: `jointscope discover` finds it"
    if named:
        title = catalogue()[named[0].effect].card.title
        labels = " ".join(shlex.quote(cause.label) for cause in causes)
        output = edited_argument(robot, named[0].effect)
        return f"it looks like {title}: jointscope add {robot_argument(robot)} {labels} -o {output}"
    if all(_is_tilt(rows, robot.joints.index(joint)) for joint in poor):
        output = edited_argument(robot, TILT)
        return f"the base seems not to be level: jointscope add {robot_argument(robot)} {TILT}@robot -o {output}"
    return NOTHING


def _is_tilt(rows: JointRows, joint: int) -> bool:
    """Whether weight in another direction explains nearly all that is missing at a joint."""
    tilts = [hypothesis for hypothesis in hypotheses_of(rows.robot) if hypothesis.here.effect.id == TILT]
    return any(_left(rows, joint, tilt, width) < LEFT for tilt in tilts for width in WIDTHS)


def _left(rows: JointRows, joint: int, tilt: EffectHypothesis, width: float) -> float:
    without, beside = rows.of(joint, width), rows.of(joint, width, tilt)
    if without is None or beside is None:
        return 1.0
    return fit(rows.robot, joint, beside, tilt).left / max(fit(rows.robot, joint, without).left, 1e-300)
