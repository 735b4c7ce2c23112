# SPDX-License-Identifier: BSD-3-Clause
"""The report of a calibration from poses and frequency responses: whether they agree, then the sections of both."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from jointscope.graphs.joint_kinds.calibrate_kinds import KindsCalibration
from jointscope.tools.acceptance.evaluation import NO_LIMITS, AcceptedBy
from jointscope.tools.presentation.frequency_sentences import (
    identifiable_sentence,
    kinds_sentences,
    matrix_sentence,
    one_realisation,
    sticking,
)
from jointscope.tools.report.frequency_report import response_sections
from jointscope.tools.report.page.acceptance import acceptance
from jointscope.tools.report.page.page import Section, listed, page
from jointscope.tools.report.poses_report import pose_sections
from jointscope.tools.verdicts.frequency_judgement import judge_kinds


def kinds_report(result: KindsCalibration, checked: AcceptedBy = NO_LIMITS, more: Sequence[Section] = ()) -> str:
    """The whole page as text, without references to anything outside of itself.

    Args:
        result: the calibration.
        checked: limits that the user has declared, as they came out.
        more: sections at the end.
    """
    responses = result.frequency
    paths = [p.poses.path for p in result.poses.problems] + [p.pose.path for p in responses.problems]
    said = [matrix_sentence(responses), identifiable_sentence(responses)]
    said += [*one_realisation(responses), *sticking(responses)]
    items = [escape(item) for item in (*kinds_sentences(result), *said)]
    verdict, *others = pose_sections(result.poses)
    sections = [
        Section("kinds", "Do the kinds agree?", listed(items), judge_kinds(result).headline),
        verdict,
        *acceptance(checked),
        *others,
        *response_sections(responses.robot, responses.start, responses.problems),
        *more,
    ]
    return page(f"{result.robot.name}: poses and frequency responses", ", ".join(paths), sections)
