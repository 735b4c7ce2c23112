# SPDX-License-Identifier: BSD-3-Clause
"""What is said of a calibration from frequency responses: fit of the matrix, what is not identifiable, values."""

from __future__ import annotations

from jointscope.graphs.frequency.calibrate_frequency import FrequencyCalibration
from jointscope.graphs.joint_kinds.calibrate_kinds import KindsCalibration
from jointscope.robots.model.robot import SHARPNESS
from jointscope.tools.presentation.numbers import significant, with_sigma


def matrix_sentence(result: FrequencyCalibration) -> str:
    """How well the model's matrix fits."""
    now, before = result.rms_log(result.robot)["rms_log"], result.rms_log(result.start)["rms_log"]
    return (
        f"logarithm of the response matrix, model over measured: {significant(now, 2)} rms, {significant(before, 2)} "
        "before; dry friction, which the torque balance knows, makes most of what is left"
    )


def identifiable_sentence(result: FrequencyCalibration) -> str:
    """What these poses do not tell."""
    if not result.silent:
        return "all springs and dampers are identifiable"
    return f"not identifiable from these poses: {', '.join(result.silent)}"


def one_realisation(result: FrequencyCalibration) -> list[str]:
    """Where a covariance rests on one realisation."""
    alone = [p.pose.path for p in result.problems if len(p.pose.matrix.each) == 1]
    text = "what friction does under other phases is taken from neighbouring lines; record more to know it"
    return [f"{path} has one realisation: {text}" for path in alone]


def sticking(result: FrequencyCalibration) -> list[str]:
    """Where friction turns over faster than velocities tell, which friction that sticks does."""
    ends = [name for name in result.names if name.endswith(f".{SHARPNESS}") and name not in result.told]
    if not ends:
        return []
    joints = ", ".join(name.split(".")[0] for name in ends)
    return [
        f"friction of {joints} turns over faster than the velocities show ({SHARPNESS}); if it sticks, which the model "
        "does not know, springs are further off than their sigmas say"
    ]


def value_rows(result: FrequencyCalibration) -> list[list[str]]:
    """Springs, dampers, friction and geometric errors that are told, and springs that are not."""
    rows = []
    for name in result.names:
        if name not in result.told and name not in result.silent:
            continue
        p, start = result.robot.parameters[name], result.start.parameters[name].value
        value, sigma = with_sigma(p.value, p.sigma or 0.0)
        note = "not identifiable" if name in result.silent else ""
        rows.append([name, significant(start, 4), value, sigma, p.unit, note])
    return rows


def kinds_sentences(result: KindsCalibration) -> list[str]:
    """Agreement first, then the sums of squares."""
    found, (alone, joint) = result.agreement, result.pose_squares
    how = "contradict each other" if found.doubtful else "agree"
    test = f"chi-square {significant(found.chi2, 3)} for {found.dof} directions that both determine, p = "
    lines = [f"poses and frequency responses {how}: {test}{significant(found.p_value, 2)}"]
    if found.dof == 0:
        lines = ["no value is told by both poses and frequency responses: whether they agree cannot be tested"]
    if found.doubtful:
        lines.append(
            "stiffness under weight is not that of the vibration, or one kind is of another arm: calibrate each alone "
            "and compare the values"
        )
    rows = sum(problem.measured for problem in result.alone.problems)
    lines.append(
        f"sum of squares of the poses: {significant(alone, 3)} alone, {significant(joint, 3)} with the responses, of "
        f"{rows} coordinates; the responses pay {significant(result.frequency_squares, 3)}"
    )
    return lines
