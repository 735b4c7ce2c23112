# SPDX-License-Identifier: BSD-3-Clause
"""A calibration from poses, and a comparison with poses, on one screen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from jointscope.graphs.poses.calibrate_poses import PoseCalibration
from jointscope.graphs.poses.determined import combination_text
from jointscope.graphs.poses.tip_errors import TipErrors, summary
from jointscope.robots.geometry.error_parameters import BEARING, STIFFNESS
from jointscope.robots.parts.parameter import Parameter
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.presentation.numbers import significant, with_sigma
from jointscope.tools.presentation.tip_numbers import target_rows, tip_cells, tip_head
from jointscope.tools.terminal.text_table import text_table
from jointscope.tools.verdicts.pose_judgement import judge_poses, outliers_of

SHOWN_OUT, SHOWN_COMBINATIONS = 5, 18
SHOWN_SIZES = ("mean", "p90", "max")
SIGMAS = 2.0  # of the bound that is said


def pose_calibration_text(result: PoseCalibration, beside: bool = False) -> str:
    """The summary of a calibration.

    Args:
        result: the calibration.
        beside: whether it is a part of one from several kinds, which has a verdict on all.
    """
    parts = [_headline(result), _verdict(result, beside), _tips(result), _parameters(result), _combinations(result)]
    return "\n\n".join(part for part in parts if part)


def pose_errors_text(by_label: Mapping[str, Mapping[str, TipErrors]], count: int) -> str:
    """Errors of some models and of each without its parts.

    Args:
        by_label: by name of the model, then by what is left in it.
        count: number of poses.
    """
    rows, head = [], list[str]()
    for label, parts in by_label.items():
        for part, errors in parts.items():
            rows.append([label, part, *tip_cells(errors)])
            head = ["model", "of it", *tip_head(errors)]
            each = target_rows(errors) if part == "whole model" else []
            rows += [[label, f"  {name}", *tip_cells(of_it)] for name, of_it in each]
    said = f"{counted(count, 'pose')}, distance of the predicted target from the measured one"
    return f"{said}\n{text_table(head, rows, '<<' + '>' * (len(head) - 2))}"


def _headline(result: PoseCalibration) -> str:
    paths = ", ".join(problem.poses.path for problem in result.problems)
    return (
        f"{result.robot.name} from {paths}: {counted(result.count, 'pose')}, "
        f"calibrated in {result.wall_seconds:.1f} s, {result.iterations} iterations"
    )


def _verdict(result: PoseCalibration, beside: bool) -> str:
    judgement = judge_poses(result)
    lines = [f"{'As far as the poses say: ' * beside}{judgement.headline}"]
    lines += [f"  ! {check.name}? {check.text}" for check in judgement.checks if check.level in ("warn", "bad")]
    lines += [f"  - {check.text}" for check in judgement.checks if check.level in ("good", "info")]
    lines += [f"  - {notice.text}" for problem in result.problems for notice in problem.poses.notices]
    odd = outliers_of(result)
    if odd:
        first = odd[:SHOWN_OUT]
        said = ", ".join(f"{each.name} of {each.path} ({each.sigmas:.0f} sigma)" for each in first)
        more = f" and {len(odd) - SHOWN_OUT} more" if len(odd) > SHOWN_OUT else ""
        lines.append(f"  - left out as outliers: pose {said}{more}")
    return "\n".join(lines)


def _tips(result: PoseCalibration) -> str:
    before, after = summary(result.before), summary(result.errors)
    named = [("before", before), ("after", after), *((f"  {name}", each) for name, each in target_rows(after))]
    head = ["target", *tip_head(after, SHOWN_SIZES)]
    return text_table(head, [[label, *tip_cells(e, SHOWN_SIZES)] for label, e in named], "<" + ">" * (len(head) - 1))


def _parameters(result: PoseCalibration) -> str:
    rows = []
    for name in result.told:
        p = result.robot.parameters[name]
        value, sigma = with_sigma(*_shown(p.value, p.sigma or 0.0, p.unit))
        rows.append([name, value, sigma, _unit(p.unit)])
    table = text_table(["parameter", "value", "± sigma", "unit"], rows, "<>><")
    return "\n\n".join([table, *silent_sentences(result)])


def _shown(value: float, sigma: float, unit: str) -> tuple[float, float]:
    factor = 1e3 if unit in ("m", "rad") else 1.0
    return factor * value, factor * sigma


def _unit(unit: str) -> str:
    return {"m": "mm", "rad": "mrad"}.get(unit, unit)


def _combinations(result: PoseCalibration) -> str:
    found: Sequence[dict[str, float]] = result.determined.combinations
    if not found:
        return "These poses tell all geometric errors apart."
    lines = [f"  - {combination_text(weights)}" for weights in found[:SHOWN_COMBINATIONS]]
    if len(found) > SHOWN_COMBINATIONS:
        lines.append(f"  - and {len(found) - SHOWN_COMBINATIONS} more")
    head = (
        f"{result.determined.rank} of {result.determined.rank + len(found)} geometric errors are independent; these "
        "combinations move no target, so priors share them out:"
    )
    return "\n".join([head, *lines])


def silent_sentences(result: PoseCalibration) -> list[str]:
    """One for what is not told, one for what is only known to be stiff."""
    silent = [name for name in result.names if name not in result.told]
    bounds = {name: bound for name in silent if (bound := _at_least(result.robot.parameters[name]))}
    others = [name for name in silent if name not in bounds]
    said = [f"The poses say nothing about {', '.join(others)}."] if others else []
    if bounds:
        stiff = ", ".join(f"{name} above {significant(bound, 2)} N m/rad" for name, bound in bounds.items())
        said.append(f"Too stiff for these poses to see them give way, so only bounds are known (two sigmas): {stiff}.")
    return said


def _at_least(p: Parameter) -> float | None:
    """Stiffness that a spring has at the least; None where poses do not say that it is above its prior.

    What poses know of the logarithm of a stiffness they know, as a share, of its compliance, which may be zero.
    """
    if not p.name.endswith((f".{STIFFNESS}", *BEARING)) or not p.positive or not p.sigma:
        return None
    told = (p.value / p.sigma) ** 2 - p.coordinate_sigma**-2.0
    if told <= 0.0:
        return None
    bound = p.value / (1.0 + SIGMAS / float(np.sqrt(told)))
    return bound if bound > p.prior else None
