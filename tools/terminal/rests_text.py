# SPDX-License-Identifier: BSD-3-Clause
"""A calibration from rests, and a comparison on rests, on one screen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from jointscope.graphs.calibration.calibration_result import CalibrationResult, ParameterEstimate
from jointscope.graphs.rest_search.next_rest import NextRest
from jointscope.graphs.rest_sets.rest_errors import RestErrors, rest_errors
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.calibrate_rests import RestCalibration
from jointscope.robots.model.robot import Robot
from jointscope.robots.rests.rests import Rests
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.presentation.next_rest_text import next_rest_sentence
from jointscope.tools.presentation.numbers import significant, with_sigma
from jointscope.tools.terminal.text_table import text_table
from jointscope.tools.verdicts.rests.rest_verdict import verdict, widened

SLIGHTLY = 1.2  # times that a sigma may be widened without a word


def rest_calibration_text(result: RestCalibration, beside: bool = False, advice: Sequence[NextRest] = ()) -> str:
    """The summary of a calibration.

    Args:
        result: the calibration.
        beside: whether it is a part of one from several kinds, which has a verdict on all.
        advice: rests to add.
    """
    paths = ", ".join(problem.rests.path for problem in result.problems)
    lines = [
        f"{result.robot.name} from {paths}: {counted(result.count, 'rest')}, calibrated in "
        f"{result.wall_seconds:.1f} s, {result.iterations} iterations",
        "",
        f"{'As far as the rests say: ' * beside}{verdict(result)}",
        f"  - links rest {significant(result.errors.error, 2)} sigma (rms) from where motors and loads put them, "
        f"{significant(result.before.error, 3)} before; 1 is expected{_widened(result)}",
    ]
    lines += rest_notices([problem.rests for problem in result.problems])
    table = rest_values(result)
    silent = f"\n\nThe rests say nothing about {', '.join(result.silent)}." if result.silent else ""
    silent += "".join(f"\n{line}" for line in _advised(result, advice))
    return "\n".join(lines) + f"\n\n{table}{silent}\n\n{_errors({result.robot.name: result.errors}, result.robot)}"


def rest_values(result: RestCalibration) -> str:
    """The table of what was found."""
    rows = [_row(p) for p in (*result.parameters, *result.derived)]
    return text_table(["parameter", "start", "value", "± sigma", "unit", ""], rows, "<>>><<")


def rest_notices(recordings: Sequence[Rests]) -> list[str]:
    """What was odd about rests, of each recording with its name where there are several."""
    several = len(recordings) > 1
    return [f"  - {f'{rests.path}: ' * several}{notice.text}" for rests in recordings for notice in rests.notices]


def _widened(result: RestCalibration) -> str:
    """That sigmas of link encoders were widened until one is what comes out; empty where they were not."""
    joint, times = widened(result.seen)
    return (
        "" if times < SLIGHTLY else f"; the sigma of {joint}'s link encoder was widened {significant(times, 2)} times"
    )


def _advised(result: RestCalibration, advice: Sequence[NextRest]) -> list[str]:
    if not advice:
        return []
    said = [f"  {next_rest_sentence(rest, result.robot)}" for rest in advice]
    return ["", "Rests that would tell most of what is hardly known, if the model holds there, too:", *said]


def rest_errors_text(by_label: Mapping[str, RestErrors], robots: Mapping[str, Robot], count: int) -> str:
    """Errors of some models, by label."""
    robot = next(iter(robots.values()))
    return f"{count} rests, links measured against where motors and loads put them\n{_errors(by_label, robot)}"


def rests_beside_motion(result: CalibrationResult) -> str:
    """What rests say of a calibration with motion; empty without rests."""
    problems = [problem.of_robot(result.robot) for problem, *_ in result.sets if isinstance(problem, RestSet)]
    if not problems:
        return ""
    errors, count = rest_errors(problems), sum(len(problem.rests) for problem in problems)
    return (
        f"{count} rests in the same estimate: links rest {significant(errors.error, 2)} sigma (rms) from where motors "
        f"and loads put them.\n{_errors({result.robot.name: errors}, result.robot)}"
    )


def _errors(by_label: Mapping[str, RestErrors], robot: Robot) -> str:
    rows = []
    for label, errors in by_label.items():
        torques, beyond, channels = errors.torques(robot), errors.beyond(robot), errors.to_json(robot)
        for joint in robot.joints:
            fit = channels[f"{joint}.link_position"]
            cells = (1e3 * fit["rmse"], fit["chi2"] ** 0.5, 1e3 * torques[joint], 1e3 * beyond[joint])
            rows.append([label, joint, *(significant(cell, 3) for cell in cells)])
    head = ["model", "joint", "link [mrad]", "in sigmas", "missing torque [mN m]", "friction beyond its band [mN m]"]
    return text_table(head, rows, "<<>>>>")


def _row(p: ParameterEstimate) -> list[str]:
    value, sigma = with_sigma(p.value, p.sigma)
    return [p.name, significant(p.start, 4), value, sigma, p.unit, p.note]
