# SPDX-License-Identifier: BSD-3-Clause
"""The report of a calibration from frequency responses: measured and model side by side, what is left, values."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.frequency.calibrate_frequency import FrequencyCalibration
from jointscope.graphs.frequency.explained import PoseFit, pose_fit
from jointscope.graphs.frequency.frequency_set import FrequencySet
from jointscope.robots.model.robot import Robot
from jointscope.tools.acceptance.evaluation import NO_LIMITS, AcceptedBy
from jointscope.tools.presentation.frequency_sentences import matrix_sentence, value_rows
from jointscope.tools.presentation.numbers import percent
from jointscope.tools.report.page.acceptance import acceptance
from jointscope.tools.report.page.answer_box import checks_listed
from jointscope.tools.report.page.page import Key, Section, figure, listed, page, text_cells
from jointscope.tools.report.page.plot import Axes, Curve, Mark, measured_with_band, plot
from jointscope.tools.verdicts.frequency_judgement import judge_frequency


def frequency_report(
    result: FrequencyCalibration, checked: AcceptedBy = NO_LIMITS, more: Sequence[Section] = ()
) -> str:
    """The whole page as text, without references to anything outside of itself.

    Args:
        result: the calibration.
        checked: limits that the user has declared, as they came out.
        more: sections at the end.
    """
    paths = ", ".join(problem.pose.path for problem in result.problems)
    verdict, *others = frequency_sections(result)
    sections = [verdict, *acceptance(checked), *others, *more]
    return page(f"{result.robot.name}: drives and bearings from frequency responses", paths, sections)


def frequency_sections(result: FrequencyCalibration) -> list[Section]:
    """What a page says of frequency responses; the verdict comes first."""
    return [_verdict(result), _values(result), *response_sections(result.robot, result.start, result.problems)]


def _verdict(result: FrequencyCalibration) -> Section:
    judgement = judge_frequency(result)
    items = [*checks_listed(judgement.checks), escape(matrix_sentence(result))]
    return Section("verdict", "Is it good?", listed(items), judgement.headline)


def response_sections(robot: Robot, start: Robot, problems: Sequence[FrequencySet]) -> list[Section]:
    """Measured and model, and what torques are left, pose by pose.

    Args:
        robot: with the values that were found.
        start: before.
        problems: the poses.
    """
    at = Calibration.of(robot).only([DYNAMICS])
    own = [problem.of_robot(robot) for problem in problems]
    responses = [_pose(robot, start, problem, k) for k, problem in enumerate(own)]
    balances = [_balance(problem, k) for k, problem in enumerate(own)]
    return [*responses, *balances, _answered([pose_fit(problem, at) for problem in own])]


def _values(result: FrequencyCalibration) -> Section:
    head = ["parameter", "start", "value", "± sigma", "unit", ""]
    lead = "Sigmas hold the residuals, what neighbouring lines have in common, and what is in doubt of friction."
    return Section("values", "Values", text_cells(head, value_rows(result), (1, 2, 3)), lead)


def _pose(robot: Robot, start: Robot, problem: FrequencySet, k: int) -> Section:
    """Bode grid from torques to accelerations, as in Fig. 11 of Neubauer et al. (2015)."""
    pose, m, panels = problem.pose, problem.pose.matrix, []
    own = pose.used
    f, square, sigmas = m.frequencies[own], pose.w**2, m.sigmas(m.total)[own]
    model, before = (problem.response({n: p.value for n, p in one.parameters.items()}) for one in (robot, start))
    for i, joint in enumerate(m.outputs):
        for j, motor in enumerate(m.inputs):
            marks = [
                *measured_with_band(f, square * np.abs(m.G[own, i, j]), square * sigmas[:, i, j]),
                Curve("start", f, square * np.abs(before[:, i, j]), "k2", "dashed"),
                Curve("model", f, square * np.abs(model[:, i, j]), "k1"),
            ]
            axes = Axes(f"{motor} to {joint} [rad/s^2/(N m)]", "frequency [Hz]", 510, 220, log_x=True, log_y=True)
            panels.append(plot(axes, marks))
    keys = [Key("measured", "k0"), Key("two sigmas", "k0", "band"), Key("model", "k1"), Key("start", "k2", "dashed")]
    lead = "From the torque of a motor to the acceleration of another; the model with friction as a sine sees it."
    return Section(f"bode{k}", f"Response in {pose.path}", figure(panels, keys), lead)


def _balance(problem: FrequencySet, k: int) -> Section:
    """What torques are left at each line, beside those that excited."""
    values = problem.robot.values
    pose = problem.pose
    left = np.sqrt(np.mean(np.abs(problem.torque_balance(values, problem.stiffness(values))) ** 2, axis=0))
    given = np.sqrt(np.mean(np.abs(pose.torques) ** 2, axis=0))
    f, panels = np.asarray(pose.w / (2.0 * np.pi)), []
    for i, joint in enumerate(problem.arm.joints):
        marks: list[Mark] = [Curve("motor", f, given[:, i], "k0"), Curve("left over", f, left[:, i], "k1")]
        panels.append(plot(Axes(f"{joint}: torque [N m]", "frequency [Hz]", height=200, log_x=True, log_y=True), marks))
    shares = ", ".join(percent(float(s)) for s in np.sqrt(np.mean(left**2, axis=0) / np.mean(given**2, axis=0)))
    lead = f"What the torque balance leaves of each motor's torque: {shares} (rms)."
    return Section(
        f"left{k}", f"What is left in {pose.path}", figure(panels, [Key("motor", "k0"), Key("left over", "k1")]), lead
    )


def _answered(fits: Sequence[PoseFit]) -> Section:
    """How much of what is left answers the excitation, band by band."""
    head = ["pose", "from [Hz]", "to [Hz]", "answers the excitation", "± sigma"]
    rows = [
        [pose.path, f"{band.low:g}", f"{band.high:g}", percent(band.share), percent(band.sigma)]
        for pose in fits
        for band in pose.answered
    ]
    lead = (
        "Share of the power that is left that comes again under other phases of the excitation, or at neighbouring "
        "lines where there is one realisation: near nothing for noise and friction, much where a response is missing."
    )
    return Section("answered", "Does what is left answer the excitation?", text_cells(head, rows, (1, 2, 3, 4)), lead)
