# SPDX-License-Identifier: BSD-3-Clause
"""What would make rests far likelier, in a sentence with the next command."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.rests.calibrate_rests import RestCalibration
from jointscope.graphs.rests.doubts import PLACE, Doubt
from jointscope.robots.model.command_words import bag_arguments, robot_argument
from jointscope.tools.presentation.numbers import significant

SURE = 1e-3  # probability by chance, from which a doubt is none any more
NEAR = 10.0  # chi2 by which others may fall less and be named as well
MOST = 3
ONE_SIDED = 0.05  # share of the rests of a motor whose friction holds the other way


def doubts_said(result: RestCalibration) -> str:
    """The verdict where rests ask for another model; empty where they do not."""
    if not result.doubts:
        return ""
    first = result.doubts[0]
    named = [d for d in result.doubts if d.fall > first.fall - NEAR][:MOST]
    so = "No, do not rely on this yet" if first.p_value < SURE else "Usable, with reservations"
    return (
        f"{so}: these rests are far likelier (chi2 falls by {significant(first.fall, 2)}, p = {first.p_value:.0e}) if "
        f"{', or '.join(_said(doubt) for doubt in named)}{_one_sided(result)}; {_next(result, named)}."
    )


def _said(doubt: Doubt) -> str:
    effect, _, owner = doubt.label.partition("@")
    return {
        "load_scale": f"loads are {significant(1.0 + doubt.size, 2)} of what /load says",
        "link_mass": f"the link of {owner} weighs something else, or elsewhere",
        "encoder_offset": f"the zero of {owner} is another",
        "torque_offset": f"a constant torque acts at {owner}, as weight does",
        "load_dependent_friction": f"friction of {owner} grows with what it carries",
        PLACE: f"friction of {owner} is not the same at all angles",
    }[effect]


def _one_sided(result: RestCalibration) -> str:
    """Joints that always came to rest from the same side: weight and friction are one there."""
    found = []
    for j, joint in enumerate(result.robot.joints):
        held = result.errors.held[:, j]
        held = held[np.isfinite(held)]
        if len(held) and min(np.mean(held > 0.0), np.mean(held < 0.0)) <= ONE_SIDED:
            found.append(joint)
    if not found:
        return ""
    return f"; {', '.join(found)} held the same way at every rest: let it come to postures from both sides"


def _next(result: RestCalibration, named: list[Doubt]) -> str:
    """What to do about it."""
    bags = bag_arguments(problem.rests.path for problem in result.problems)
    command = f"`jointscope diagnose {robot_argument(result.start)} --rests {bags}`"
    if all(doubt.label.startswith(PLACE) for doubt in named):
        return "nothing in the catalogue holds that: calibrate from rests near the postures that you need"
    return f"weigh, correct, and calibrate again; {command} ranks what may be missing"
