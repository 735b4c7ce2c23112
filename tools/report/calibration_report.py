# SPDX-License-Identifier: BSD-3-Clause
"""The report of a calibration: one page that says first whether it is good."""

from __future__ import annotations

from dataclasses import replace

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.frequency.frequency_summary import FrequencySummary
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.tip_errors import tip_errors
from jointscope.tools.acceptance.evaluation import NO_LIMITS, AcceptedBy
from jointscope.tools.report.frequency_report import response_sections
from jointscope.tools.report.page.acceptance import acceptance
from jointscope.tools.report.page.notices import notices
from jointscope.tools.report.page.page import Section, page
from jointscope.tools.report.page.provenance import provenance
from jointscope.tools.report.poses_report import left_of_poses
from jointscope.tools.report.sections.calibration.commands import commands
from jointscope.tools.report.sections.calibration.convergence import convergence
from jointscope.tools.report.sections.calibration.correlation import correlation
from jointscope.tools.report.sections.calibration.fits import fits
from jointscope.tools.report.sections.calibration.mounting import mounting
from jointscope.tools.report.sections.calibration.noise import noise
from jointscope.tools.report.sections.calibration.parameters import parameters
from jointscope.tools.report.sections.calibration.residuals import residuals
from jointscope.tools.report.sections.calibration.rest_pictures import rest_pictures, rests_of
from jointscope.tools.report.sections.calibration.states import states
from jointscope.tools.report.sections.calibration.verdict import verdict
from jointscope.tools.report.sections.calibration.weak_directions import weak_directions
from jointscope.tools.verdicts.same_values import same_values
from jointscope.tools.writing.origin import other_kinds


def calibration_report(result: CalibrationResult, checked: AcceptedBy = NO_LIMITS) -> str:
    """The whole page as text.

    Args:
        result: what the calibration found.
        checked: limits that the user has declared, as they came out.

    Returns:
        HTML without references to anything outside of itself.
    """
    recordings = [bag.recording for bag in result.bags]
    motion = not result.robot.free_links
    sections = [
        verdict(result),
        *acceptance(checked),
        parameters(result),
        *rest_pictures(*rests_of(result)),
        *_kinds_beside_motion(result),
        *([mounting(result)] if result.robot.gyros else []),
        *([fits(result), commands(result)] if motion else []),
        residuals(result),
        weak_directions(result),
        correlation(result),
        *([noise(result), states(result)] if motion else []),
        convergence(result),
        notices(recordings),
        provenance(recordings, [result.robot], result.wall_seconds, other_kinds(result)),
    ]
    names = ", ".join(recording.path for recording in recordings)
    return page(f"Calibration of {result.robot.name}", f"{names} · {result.robot.description}", sections)


def _kinds_beside_motion(result: CalibrationResult) -> list[Section]:
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
