# SPDX-License-Identifier: BSD-3-Clause
"""A calibration from rests, and a comparison on rests, on one screen."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult, ParameterEstimate
from jointscope.graphs.rests.calibrate_rests import RestCalibration
from jointscope.graphs.rests.rest_errors import SURELY, RestErrors, rest_errors
from jointscope.graphs.rests.rest_set import RestSet
from jointscope.graphs.rests.taken_for_granted import all_rigid
from jointscope.robots.model.command_words import bag_arguments, robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.relative_sigma import relative_sigma
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.presentation.numbers import significant, with_sigma
from jointscope.tools.terminal.text_table import text_table
from jointscope.tools.verdicts.rest_doubts import doubts_said

LOOSE = 0.25  # sigma of a value above zero, over it, from which it is hardly known
AS_EXPECTED, DOUBTFUL = 1.3, 2.0  # [sigma] error of rests that sensors explain, and that they do not
WIDENED, FAR = 1.5, 3.0  # times that sigmas of link encoders were widened: more than they may repeat, and no noise
FOLLOWS, BY_CHANCE = 0.1, 1e-5  # share of what friction holds that weights explain, and how likely by chance
BEYOND = 0.1  # of its band, that friction may have to hold beyond it


def rest_calibration_text(result: RestCalibration) -> str:
    """The summary of a calibration."""
    paths = ", ".join(problem.rests.path for problem in result.problems)
    lines = [
        f"{result.robot.name} from {paths}: {result.count} rests, calibrated in {result.wall_seconds:.1f} s, "
        f"{result.iterations} iterations",
        "",
        verdict(result),
        f"  - links rest {significant(result.errors.error, 2)} sigma (rms) from where motors and loads put them, "
        f"{significant(result.before.error, 3)} before; 1 is expected",
    ]
    lines += [f"  - {notice.text}" for problem in result.problems for notice in problem.rests.notices]
    table = text_table(
        ["parameter", "start", "value", "± sigma", "unit", ""],
        [_row(p) for p in (*result.parameters, *result.derived)],
        "<>>><<",
    )
    silent = f"\n\nThe rests say nothing about {', '.join(result.silent)}." if result.silent else ""
    return "\n".join(lines) + f"\n\n{table}{silent}\n\n{_errors({result.robot.name: result.errors}, result.robot)}"


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


def verdict(result: RestCalibration) -> str:
    """Whether the model holds at rest, and whether the rests tell its values."""
    error = result.errors.error
    if error > DOUBTFUL:
        return "No, do not rely on this yet: links do not rest where the model says."
    if doubt := _following(result):
        return f"No, do not rely on this yet: {doubt}."
    if doubt := doubts_said(result):
        return doubt
    if doubt := _misfit(result):
        return f"No, do not rely on this yet: {doubt}; something is missing: {_diagnosis(result)}"
    for owner, values in Counter(p.name.split(".")[0] for p in result.parameters).most_common(1):
        if result.count <= values:
            few = f"{counted(result.count, 'rest')} for {values} values of {owner}"
            return f"No, do not rely on this yet: {few}; nothing could contradict them."
    values_of = result.robot.parameters
    told = [p for p in result.parameters if values_of[p.name].positive and values_of[p.name].null is None]
    loose = [p for p in told if p.sigma > LOOSE * p.value]
    if loose:
        names = ", ".join(f"{p.name} ({relative_sigma(p.sigma / abs(p.value))})" for p in loose)
        so = "No, do not rely on this yet" if len(loose) == len(told) else "Usable, with reservations"
        return f"{so}: these rests hardly tell {names}; let it rest {_more(result, loose)}."
    if error > AS_EXPECTED or _widened(result)[1] > WIDENED:
        return "Usable, with reservations: links rest further from where the model says than their encoders explain."
    return "Yes, the model holds at these rests."


def _more(result: RestCalibration, loose: Sequence[ParameterEstimate]) -> str:
    """How many rests more would tell loose values: edges of a band are known as well as rests lie apart in it."""
    times = max(p.sigma / p.value for p in loose) / LOOSE
    more = int(np.ceil((times - 1.0) * result.count))
    return f"about {counted(more, 'time')} more, in other postures or with other weights"


def _widened(result: RestCalibration) -> tuple[str, float]:
    """The joint whose link encoder repeats worst, and its sigma over the stated one."""
    scale = result.problems[0].repeatability
    j = int(scale.argmax())
    return result.robot.joints[j], float(scale[j])


def _misfit(result: RestCalibration) -> str:
    """Links far from where the model has them, friction far beyond its band; empty where noise explains all."""
    joint, widened = _widened(result)
    if widened > FAR:
        return (
            f"{joint} rests {significant(widened, 2)} sigmas of its encoder away, and its sigma was widened by as much "
            "to go on, unless other loads hung there than /load says"
        )
    bands, rigid = result.errors.bands, all_rigid(result.robot)
    for j, joint in enumerate(result.robot.joints):
        beyond = float(result.errors.certain[:, j].max(initial=0.0))
        # friction of a rigid joint is that of any masses and loads that these might be instead, as well as it is known
        known = sum(p.sigma for p in result.parameters if p.name.startswith(f"{joint}.")) if rigid else 0.0
        if beyond > BEYOND * bands[j] + SURELY * known:
            return (
                f"friction of {joint} would have to hold {significant(1e3 * beyond, 2)} mN m beyond a band of "
                f"{significant(1e3 * bands[j], 2)} mN m"
            )
        creeping = float(result.errors.off_creeping[j])
        if creeping > BEYOND * bands[j]:
            return (
                f"friction of {joint} is {significant(1e3 * creeping, 2)} mN m (rms) off a band of "
                f"{significant(1e3 * bands[j], 2)} mN m where it creeps, as if it depended on speed or place"
            )
    return ""


def _following(result: RestCalibration) -> str:
    """A rigid joint whose friction holds what loads and gravity say; empty where none does."""
    for j, joint in enumerate(result.robot.joints):
        share, chance = result.errors.following(j)
        if share > FOLLOWS and chance < BY_CHANCE:
            return (
                f"{significant(100 * share, 2)} % of what friction of {joint} has to hold goes with loads and gravity, "
                "of which friction knows nothing: /load has another sign, unit or frame, a mass is another, or the "
                "joint was not moved as weights changed"
            )
    return ""


def _diagnosis(result: RestCalibration) -> str:
    """The command that looks for it."""
    bags = bag_arguments(problem.rests.path for problem in result.problems)
    return f"`jointscope diagnose {robot_argument(result.start)} --rests {bags}`"


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
