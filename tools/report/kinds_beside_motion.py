# SPDX-License-Identifier: BSD-3-Clause
"""What poses and frequency responses look like in the report of a calibration with motion."""

from __future__ import annotations

from dataclasses import replace

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.frequency.frequency_summary import FrequencySummary
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.tip_errors import tip_errors
from jointscope.tools.report.frequency_report import response_sections
from jointscope.tools.report.page.page import Section
from jointscope.tools.report.poses_report import left_of_poses
from jointscope.tools.verdicts.same_values import same_values


def kinds_beside_motion(result: CalibrationResult) -> list[Section]:
    """Whether motion and responses agree, measured and model of each, and what is left of poses; none without them."""
    poses = [problem.of_robot(result.robot) for problem, *_ in result.sets if isinstance(problem, PoseSet)]
    shaken = [pose for problem, *_ in result.sets if isinstance(problem, FrequencySummary) for pose in problem.problems]
    found = []
    if poses:
        found.append(left_of_poses(poses, [tip_errors(problem) for problem in poses]))
        found[0] = replace(found[0], id="poses", title="What is left of the poses")
    if shaken:
        known = result.robot.parameters
        began = result.robot.with_values({p.name: p.start for p in result.parameters if p.name in known})
        found += response_sections(result.robot, began, shaken)
        said = " ".join(text for *_, text in same_values(result))
        found[-1] = replace(found[-1], lead=f"{said} {found[-1].lead}".strip())
    return found
