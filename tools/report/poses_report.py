# SPDX-License-Identifier: BSD-3-Clause
"""The report of a calibration from poses: verdict, errors of the target before and after, where they lie, values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from html import escape

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.joint_kinds.discover_arm import ArmDiscovery
from jointscope.graphs.poses.calibrate_poses import PoseCalibration
from jointscope.graphs.poses.determined import combination_text
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.tip_errors import TipErrors, parts_of, summary
from jointscope.tools.acceptance.evaluation import NO_LIMITS, AcceptedBy
from jointscope.tools.presentation.numbers import with_sigma
from jointscope.tools.presentation.tip_numbers import target_rows, tip_cells, tip_head
from jointscope.tools.report.page.acceptance import acceptance
from jointscope.tools.report.page.answer_box import checks_listed
from jointscope.tools.report.page.page import Key, Section, figure, listed, page, table, text_cells
from jointscope.tools.report.page.plot import Axes, Bars, Curve, plot
from jointscope.tools.terminal.searches.arm_discovery_text import step_table
from jointscope.tools.verdicts.pose_judgement import judge_poses, outliers_of

Array = NDArray[np.float64]
BINS = 30
MM, MICRO = 1e3, 1e6


def poses_report(
    result: PoseCalibration,
    checked: AcceptedBy = NO_LIMITS,
    more: Sequence[Section] = (),
) -> str:
    """The whole page as text, without references to anything outside of itself.

    Args:
        result: the calibration.
        checked: limits that the user has declared, as they came out.
        more: sections at the end.
    """
    paths = ", ".join(problem.poses.path for problem in result.problems)
    sections = pose_sections(result)
    sections[1:1] = acceptance(checked)
    return page(f"{result.robot.name}: geometry and sag from poses", paths, [*sections, *more])


def pose_sections(result: PoseCalibration) -> list[Section]:
    """What a page says of poses; the verdict comes first."""
    makers = (_verdict, _waterfall, _histogram, _against, _values, _silent)
    return [make(result) for make in makers]


def steps_section(found: ArmDiscovery) -> Section:
    """The waterfall: what each effect that was added is worth."""
    head, rows = step_table(found)
    lead = f"The search ended because {found.stop_reason}."
    return Section("steps", "What was missing", text_cells(head, rows, range(2, len(head))), lead)


def _verdict(result: PoseCalibration) -> Section:
    judgement = judge_poses(result)
    items = checks_listed(judgement.checks)
    items += [
        f"pose {escape(each.name)} of {escape(each.path)} was left out: {each.sigmas:.0f} sigma away"
        for each in outliers_of(result)
    ]
    return Section("verdict", "Is it good?", listed(items), judgement.headline)


def _waterfall(result: PoseCalibration) -> Section:
    """What each part of the model is worth on the poses that were used."""
    each = [parts_of(replace(problem, robot=result.robot)) for problem in result.problems]
    errors = {part: summary([found[part] for found in each]) for part in reversed(each[0])}
    rows = [[escape(part), *tip_cells(found)] for part, found in errors.items()]
    rows += [[f"whole model: {escape(name)}", *tip_cells(found)] for name, found in target_rows(errors["whole model"])]
    head = ["model", *tip_head(errors["whole model"])]
    lead = "Distance of the predicted target from the measured one, with and without each part of the model."
    return Section("parts", "What each part is worth", table(head, rows, range(1, len(head))), lead)


def _histogram(result: PoseCalibration) -> Section:
    before, after = summary(result.before), summary(result.errors)
    named = [("before", "k0", before), ("after", "k1", after)]
    bars = [(title, colour, "distance [mm]", MM * each.distances) for title, colour, each in named]
    bars += [(title, colour, "turn [mrad]", MM * each.angles) for title, colour, each in named if len(each.turns)]
    pictures = []
    for title, colour, label, values in bars:
        counts, edges = np.histogram(values, BINS, (0.0, float(values.max()) * 1.02 + 1e-12))
        axes = Axes(f"{title}: number of poses", x_label=label, width=510)
        pictures.append(figure([plot(axes, [Bars(title, edges, counts.astype(float), colour)])]))
    return Section(
        "histogram", "How far off", "".join(pictures), "Every pose is one error; the last bar is the worst one."
    )


def _against(result: PoseCalibration) -> Section:
    return left_of_poses(result.problems, result.errors)


def left_of_poses(problems: Sequence[PoseSet], left: Sequence[TipErrors]) -> Section:
    """What is left against the order of the poses and each joint: a trend is something that the model lacks.

    Args:
        problems: sessions of poses.
        left: how far targets are from where the model has them, for each session.
    """
    panels = []
    for problem, errors in zip(problems, left, strict=True):
        number = np.arange(len(problem.poses), dtype=float)
        over = {"pose, in the order of the session": number}
        over |= {f"{joint} [rad]": problem.q[:, j] for j, joint in enumerate(problem.arm.chain.joints)}
        for label, x in over.items():
            panels.append(_dots(label, x[errors.poses], errors.vectors, "left over [um]"))
            if len(errors.turns):
                panels.append(_dots(label, x[errors.turned], errors.turns, "turn left over [urad]"))
    keys = [Key("x", "k0"), Key("y", "k1"), Key("z", "k2")]
    lead = "A cloud without a shape is wanted. Drift over the session is the tracker's; waves over a joint are its own."
    return Section("left", "What is left", figure(panels, keys), lead)


def _dots(label: str, x: Array, vectors: Array, title: str) -> str:
    order = np.argsort(x)
    axes = Axes(title, x_label=label, height=170, zoomable=False)
    marks = [Curve("xyz"[k], x[order], MICRO * vectors[order, k], f"k{k}", "dots") for k in range(3)]
    return plot(axes, marks)


def _values(result: PoseCalibration) -> Section:
    rows = []
    for name in result.names:
        p = result.robot.parameters[name]
        factor, unit = (1e3, "mm" if p.unit == "m" else "mrad") if p.unit in ("m", "rad") else (1.0, p.unit)
        value, sigma = with_sigma(factor * p.value, factor * (p.sigma or 0.0))
        told = "" if name in result.told else "not determined by these poses"
        rows.append([escape(name), value, sigma, escape(unit), told])
    lead = (
        "Standard deviations include what transmissions do unseen. Geometric errors that look alike share their values."
    )
    return Section("values", "Values", table(["parameter", "value", "± sigma", "unit", ""], rows, [1, 2]), lead)


def _silent(result: PoseCalibration) -> Section:
    items = [escape(combination_text(weights)) for weights in result.determined.combinations]
    lead = f"{result.determined.rank} combinations of geometric errors are determined; these move no target:"
    return Section("silent", "What these poses cannot determine", listed(items), lead)
