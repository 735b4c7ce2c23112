# SPDX-License-Identifier: BSD-3-Clause
"""Is a calibration from rests and other kinds without motion good? The checks of each, and whether they agree."""

from __future__ import annotations

from jointscope.graphs.joint_kinds.all_kinds import StillCalibration
from jointscope.graphs.joint_kinds.calibrate_kinds import KindsCalibration
from jointscope.graphs.joint_kinds.calibrate_with_rests import WithRests
from jointscope.graphs.poses.calibrate_poses import PoseCalibration
from jointscope.tools.verdicts.frequency_judgement import judge_frequency, judge_kinds
from jointscope.tools.verdicts.judgement import Check, Judgement
from jointscope.tools.verdicts.pose_judgement import judge_poses
from jointscope.tools.verdicts.rests.beside_motion import TOLD, rest_checks
from jointscope.tools.verdicts.rests.rest_verdict import hardly_told
from jointscope.tools.verdicts.same_values import NAME, agreed, test_said


def judge_with_rests(result: WithRests) -> Judgement:
    """Applies all checks of all kinds."""
    rests = [Check(*each) for each in rest_checks(result.rests.seen)]
    _, untold = hardly_told(result.rests)
    if untold:
        rests = [check for check in rests if check.name != TOLD]
        rests.append(Check("warn", TOLD, f"{untold[0].upper()}{untold[1:]}."))
    return Judgement.of((_agree(result), *rests, *_judged(result.others).checks))


def others_named(result: WithRests) -> str:
    """The kinds beside rests, as a sentence names them."""
    named = (("poses", result.poses), ("frequency responses", result.frequency))
    return " and ".join(name for name, there in named if there is not None)


def _agree(result: WithRests) -> Check:
    """Springs, friction and geometry of rests against those of the other kinds."""
    said, others = test_said(result.agreement), others_named(result)
    if not result.agreement.doubtful:
        return Check(*agreed(result.agreement, f"Rests agree with {others}", f"rests and {others}"))
    text = (
        f"Rests contradict {others}: {said}. Friction or stiffness at rest is not that of the other kind, a load or a "
        "mass is another, or one kind is of another arm: calibrate each alone and compare the values."
    )
    return Check("bad", NAME, text)


def _judged(others: StillCalibration) -> Judgement:
    if isinstance(others, KindsCalibration):
        return judge_kinds(others)
    return judge_poses(others) if isinstance(others, PoseCalibration) else judge_frequency(others)
