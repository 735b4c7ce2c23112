# SPDX-License-Identifier: BSD-3-Clause
"""The report of effects that were found from poses, frequency responses or both: the steps, then the last model."""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.graphs.joint_kinds.discover_arm import ArmDiscovery
from jointscope.tools.report.frequency_report import frequency_sections, response_sections
from jointscope.tools.report.page.page import Section, page
from jointscope.tools.report.poses_report import pose_sections, steps_section


def arm_search_report(found: ArmDiscovery, more: Sequence[Section] = ()) -> str:
    """The whole page as text, without references to anything outside of itself.

    Args:
        found: the discovery.
        more: sections at the end.
    """
    last, sections, paths = found.steps[-1].calibrated, list[Section](), list[str]()
    if last.poses is not None:
        sections += pose_sections(last.poses)
        paths += [problem.poses.path for problem in last.poses.problems]
    if last.frequency is not None:
        own, problems = last.frequency, last.frequency.problems
        sections += response_sections(own.robot, own.start, problems) if sections else frequency_sections(own)
        paths += [problem.pose.path for problem in problems]
    sections.insert(1, steps_section(found))
    title = f"{found.robot.name}: what is missing, from {' and '.join(found.kinds)}"
    return page(title, ", ".join(paths), [*sections, *more])
