# SPDX-License-Identifier: BSD-3-Clause
"""What would make rests far likelier, in a sentence with the next command."""

from __future__ import annotations

from jointscope.graphs.rests.doubts import PLACE, Doubt
from jointscope.graphs.rests.seen_rests import SeenRests
from jointscope.robots.model.command_words import bag_arguments, robot_argument
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.verdicts.rests.not_told import from_one_side

SURE = 1e-3  # probability by chance, from which a doubt is none any more
NEAR = 10.0  # chi2 by which others may fall less and be named as well
MOST = 3


def doubts_said(seen: SeenRests) -> tuple[str, str]:
    """Level of `judgement.LEVELS` and sentence where rests ask for another model; empty where they do not."""
    if not seen.doubts:
        return "good", ""
    first, sides = seen.doubts[0], from_one_side(seen)
    named = [d for d in seen.doubts if d.fall > first.fall - NEAR][:MOST]
    return "bad" if first.p_value < SURE else "warn", (
        f"these rests are far likelier (chi2 falls by {significant(first.fall, 2)}, p = {first.p_value:.0e}) if "
        f"{', or '.join(_said(doubt) for doubt in named)}{sides and f'; {sides}'}; {_next(seen, named)}"
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


def _next(seen: SeenRests, named: list[Doubt]) -> str:
    """What to do about it."""
    bags = bag_arguments(problem.rests.path for problem in seen.problems)
    command = f"`jointscope diagnose {robot_argument(seen.start)} --rests {bags}`"
    if all(doubt.label.startswith(PLACE) for doubt in named):
        return "nothing in the catalogue holds that: calibrate from rests near the postures that you need"
    return f"weigh, correct, and calibrate again; {command} ranks what may be missing"
