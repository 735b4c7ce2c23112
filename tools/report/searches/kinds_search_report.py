# SPDX-License-Identifier: BSD-3-Clause
"""The report of a model grown by recordings of several kinds: the steps, what is left, each kind at its end."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from jointscope.graphs.across_kinds.discover_kinds import KindsDiscovery
from jointscope.tools.report.frequency_report import response_sections
from jointscope.tools.report.page.page import Key, Section, figure, listed, page, table, text_cells
from jointscope.tools.report.page.plot import Axes, Curve, plot
from jointscope.tools.report.poses_report import pose_sections
from jointscope.tools.report.rests_report import rest_sections
from jointscope.tools.report.sections.diagnosis.ranking import ranking
from jointscope.tools.terminal.searches.kinds_discovery_text import kinds_found, kinds_steps, left_said
from jointscope.tools.terminal.searches.kinds_text import HEAD, WORDS, kinds_rows, kinds_sentences


def kinds_search_report(found: KindsDiscovery, more: Sequence[Section] = ()) -> str:
    """The whole page as text, without references to anything outside of itself.

    Args:
        found: the discovery.
        more: sections at the end.
    """
    last = found.steps[-1].found
    sections = [_steps(found), _left(found)]
    if last.motion is not None:
        sections.append(ranking(last.motion, title="What motion alone says of the last model"))
    if last.arm_base is not None and last.arm_base.poses is not None:
        sections += pose_sections(last.arm_base.poses)[1:]
    if last.arm_base is not None and last.arm_base.frequency is not None:
        own = last.arm_base.frequency
        sections += response_sections(own.robot, own.start, own.problems)
    if last.rests is not None:
        sections += rest_sections(last.rests.steps[-1].result)[1:]
    given = found.given
    title = f"{found.robot.name}: what is missing, from {' and '.join(given.kinds)}"
    return page(title, ", ".join(given.paths), [*sections, *more])


def _steps(found: KindsDiscovery) -> Section:
    """The waterfall: what each effect is worth in each kind."""
    head, rows = kinds_steps(found)
    lead = (
        "One model, calibrated with all recordings in one graph: how far it is off in each kind, in sigmas of the last "
        f"model's noise. The search ended because {found.stop_reason}."
    )
    cells, items = text_cells(head, rows, range(2, len(head))), listed([escape(line) for line in kinds_found(found)])
    return Section("steps", "What was missing", f"{cells}{_fall(found)}{items}", lead)


def _fall(found: KindsDiscovery) -> str:
    """How the error of each kind falls, as a curve over the steps; nothing where no step followed."""
    if len(found.steps) < 2:
        return ""
    x, curves = np.arange(len(found.steps), dtype=float), list[Curve]()
    for i, kind in enumerate(found.given.kinds):
        errors = np.array([train[kind] for train, _ in found.errors])
        if errors[-1] > 0.0:
            curves.append(Curve(WORDS[kind], x, errors / errors[-1], f"k{i}", "wide"))
    axes = Axes("error for training over that of the last model", x_label="step", log_y=True, zoomable=False)
    return figure([plot(axes, curves)], [Key(curve.name, curve.colour) for curve in curves])


def _left(found: KindsDiscovery) -> Section:
    """What all kinds say of the last model."""
    last = found.steps[-1].found
    rows = [[escape(cell) for cell in row] for row in kinds_rows(last)]
    body = listed([escape(sentence) for sentence in kinds_sentences(last)]) + table(HEAD, rows, ())
    lead = f"{left_said(found)} The sections below are of each kind alone."
    return Section("left", "What may be missing still", body, lead)
