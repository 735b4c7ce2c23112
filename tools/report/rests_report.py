# SPDX-License-Identifier: BSD-3-Clause
"""The report of a calibration from rests alone: verdict, springs and friction as pictures, values."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from jointscope.graphs.rest_search.next_rest import NextRest
from jointscope.graphs.rests.calibrate_rests import RestCalibration
from jointscope.tools.acceptance.evaluation import NO_LIMITS, AcceptedBy
from jointscope.tools.presentation.next_rest_text import next_rest_sentence
from jointscope.tools.presentation.numbers import significant, with_sigma
from jointscope.tools.report.page.acceptance import acceptance
from jointscope.tools.report.page.page import Section, listed, page, table
from jointscope.tools.report.sections.calibration.rest_pictures import rest_pictures
from jointscope.tools.verdicts.rests.rest_verdict import verdict


def rests_report(
    result: RestCalibration,
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
    paths = ", ".join(problem.rests.path for problem in result.problems)
    first, *others = rest_sections(result, advice)
    sections = [first, *acceptance(checked), *others, *more]
    return page(f"{result.robot.name}: springs, friction and weight from rests", paths, sections)


def rest_sections(result: RestCalibration, advice: Sequence[NextRest] = ()) -> list[Section]:
    """Verdict, pictures, values, and rests to add."""
    problems = [problem.of_robot(result.robot) for problem in result.problems]
    found = [_verdict(result), *rest_pictures(problems, result.covariance), _values(result)]
    if not advice:
        return found
    said = [escape(next_rest_sentence(rest, result.robot)) for rest in advice]
    lead = "Rests that would tell most of what is hardly known, if the model holds there, too."
    return [*found, Section("next_rests", "Which rest next?", listed(said), lead)]


def _verdict(result: RestCalibration) -> Section:
    errors = result.errors
    lead = (
        f"{verdict(result)} {result.count} rests: links rest {significant(errors.error, 2)} sigma (rms) from where "
        f"motors and loads say, {significant(result.before.error, 3)} before; 1 is expected."
    )
    torques, beyond = errors.torques(result.robot), errors.beyond(result.robot)
    rows = [
        [escape(joint), significant(1e3 * torques[joint], 3), significant(1e3 * beyond[joint], 3)]
        for joint in result.robot.joints
    ]
    head = ["joint", "missing torque, rms [mN m]", "friction beyond its band, largest [mN m]"]
    return Section("verdict", "Does the model hold at rest?", table(head, rows, (1, 2)), lead)


def _values(result: RestCalibration) -> Section:
    rows = []
    for p in (*result.parameters, *result.derived):
        value, sigma = with_sigma(p.value, p.sigma)
        rows.append([escape(p.name), significant(p.start, 4), value, sigma, escape(p.unit), escape(p.note)])
    lead = f"The rests say nothing about {', '.join(result.silent)}." if result.silent else ""
    return Section(
        "values", "Values", table(["parameter", "start", "value", "± sigma", "unit", ""], rows, (1, 2, 3)), lead
    )
