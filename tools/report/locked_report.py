# SPDX-License-Identifier: BSD-3-Clause
"""The report of a transmission that locked springs alone show: verdict, matrix element by element, what links did."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from jointscope.graphs.locked_springs.coupling import Coupling
from jointscope.tools.acceptance.evaluation import NO_LIMITS, AcceptedBy
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.acceptance import acceptance
from jointscope.tools.report.page.page import Section, page, table
from jointscope.tools.terminal.coupling_text import coupling_rows


def locked_report(found: Coupling, checked: AcceptedBy = NO_LIMITS, more: Sequence[Section] = ()) -> str:
    """The whole page as text, without references to anything outside of itself.

    Args:
        found: the transmission.
        checked: limits that the user has declared, as they came out.
        more: sections at the end.
    """
    paths = ", ".join(readings.path for fit in found.fits for readings in fit.readings)
    sections = [_matrix(found), *acceptance(checked), _joints(found), *more]
    return page(f"{found.robot.name}: transmission from locked springs", paths, sections)


def _matrix(found: Coupling) -> Section:
    rows = [[escape(cell) for cell in row] for row in coupling_rows(found)]
    lead = escape(found.sentence() or "The transmission of the robot file is the one that the locked springs show.")
    head = ["link angle per motor angle", "file", "value", "± sigma"]
    return Section("matrix", "Which motors turn which links?", table(head, rows, (1, 2, 3)), lead)


def _joints(found: Coupling) -> Section:
    rows = [
        [escape(joint), significant(1e3 * fit.rms[k], 3), significant(1e3 * fit.explained[k], 3)]
        for fit in found.fits
        for k, joint in enumerate(fit.readings[0].joints)
    ]
    head = ["joint", "motor from links, rms [mrad or mm]", "encoders explain [mrad or mm]"]
    lead = "Motors follow links as far as encoders tell; springs that deflect by more are refused."
    return Section("joints", "Do motors follow links?", table(head, rows, (1, 2)), lead)
