# SPDX-License-Identifier: BSD-3-Clause
"""The report of poses, frequency responses and rests in one estimate: do they agree, then the parts of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from html import escape

from jointscope.graphs.joint_kinds.calibrate_kinds import KindsCalibration
from jointscope.graphs.joint_kinds.calibrate_with_rests import WithRests
from jointscope.graphs.rest_search.next_rest import NextRest
from jointscope.tools.acceptance.evaluation import NO_LIMITS, AcceptedBy
from jointscope.tools.presentation.frequency_sentences import (
    identifiable_sentence,
    kinds_sentences,
    matrix_sentence,
    one_realisation,
    sticking,
)
from jointscope.tools.report.frequency_report import frequency_sections, response_sections
from jointscope.tools.report.page.acceptance import acceptance
from jointscope.tools.report.page.page import Section, listed, page
from jointscope.tools.report.poses_report import pose_sections
from jointscope.tools.report.rests_report import rest_sections
from jointscope.tools.verdicts.frequency_judgement import judge_kinds
from jointscope.tools.verdicts.with_rests_judgement import judge_with_rests, others_named


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


def with_rests_report(
    result: WithRests,
    checked: AcceptedBy = NO_LIMITS,
    more: Sequence[Section] = (),
    advice: Sequence[NextRest] = (),
) -> str:
    """The whole page as text, without references to anything outside of itself.

    Args:
        result: the calibration.
        checked: limits that the user has declared, as they came out.
        more: sections at the end.
        advice: rests to add.
    """
    judgement, parts, paths = judge_with_rests(result), list[tuple[str, list[Section]]](), list[str]()
    if result.poses is not None:
        parts.append(("Poses", pose_sections(result.poses)))
        paths += [problem.poses.path for problem in result.poses.problems]
    if result.frequency is not None:
        parts.append(("Frequency responses", frequency_sections(result.frequency)))
        paths += [problem.pose.path for problem in result.frequency.problems]
    parts.append(("Rests", rest_sections(result.rests, advice)))
    paths += [problem.rests.path for problem in result.rests.problems]
    items = "".join(f"<li><b>{escape(check.name)}</b>: {escape(check.text)}</li>" for check in judgement.checks)
    sections = [Section("kinds", "Is it good?", f"<ul>{items}</ul>", judgement.headline), *acceptance(checked)]
    for kind, own in parts:
        sections += [replace(s, id=f"{kind.split()[0].lower()}-{s.id}", title=f"{kind}: {s.title}") for s in own]
    title = f"{result.robot.name}: rests and {others_named(result)}"
    return page(title, ", ".join(paths), [*sections, *more])
