# SPDX-License-Identifier: BSD-3-Clause
"""What rests say nothing about, in sentences: joints that stood or came from one side, gains, masses and loads."""

from __future__ import annotations

import numpy as np
from scipy.stats import binom

from jointscope.graphs.rests.doubts import LIKELY
from jointscope.graphs.rests.seen_rests import SeenRests
from jointscope.graphs.rests.taken_for_granted import LOAD, MASS, all_rigid
from jointscope.graphs.rests.unnoticed import WEIGHTS
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.presentation.numbers import significant

ONE_SIDED = 0.05  # share of the rests of a motor whose friction holds the other way
OPEN, LOOSE_GAIN = 0.5, 0.1  # of its prior's sigma, and of a gain: how well it has to be known to be told


def standing(seen: SeenRests) -> str:
    """Joints that stood all the time; empty where none did."""
    if not seen.stood:
        return ""
    return (
        f"{', '.join(seen.stood)} never moved before any of these {counted(seen.count, 'rest')}, which say nothing "
        "about friction there nor whether what it carries weighs what the model says: move it before each rest, to "
        "postures from above and from below"
    )


def one_sided(seen: SeenRests) -> tuple[str, ...]:
    """Rigid joints that always came to rest from the same side, by no chance: weight and friction are one there."""
    found, held = [], seen.errors.held
    for j, joint in enumerate(seen.robot.joints):
        y = held[np.isfinite(held[:, j]), j]
        fewer = min(int(np.sum(y > 0.0)), int(np.sum(y < 0.0)))
        chance = 2.0 * float(binom.cdf(fewer, len(y), 0.5)) * len(seen.robot.joints)
        if len(y) and fewer <= ONE_SIDED * len(y) and chance < LIKELY:
            found.append(joint)
    return tuple(found)


def from_one_side(seen: SeenRests) -> str:
    """These joints and what to do; empty where there are none."""
    joints = ", ".join(one_sided(seen))
    return f"{joints} held the same way at every rest: let it come to postures from both sides" if joints else ""


def open_gains(seen: SeenRests) -> str:
    """Gains that are asked of rests that do not tell them; empty where all are told."""
    known, found = {p.name: p.sigma for p in seen.parameters}, []
    for joint in seen.robot.joints:
        p = seen.start.parameters.get(f"{joint}.{seen.robot.drive_gain}")
        if p is not None and not p.fixed:
            sigma = known.get(p.name, p.prior_sigma)
            if sigma > OPEN * p.prior_sigma and sigma > LOOSE_GAIN * abs(p.value):
                found.append(p.name)
    if not found:
        return ""
    return (
        f"{', '.join(found)} cannot be told where a joint carries little weight, nor can friction there: hold it with "
        "`fixed: true` and the value of the data sheet, or let it carry more"
    )


def unchecked(seen: SeenRests) -> str:
    """Masses and loads that might be wrong by more than is usual without a contradiction, and what rests on them."""
    parts, scale = list[str](), ""
    for each in seen.unnoticed:
        effect, _, owner = each.label.partition("@")
        if each.label == WEIGHTS:
            scale = _on_one_scale(each.share)
            continue
        loads, all_of_it = effect == "load_scale", np.isinf(each.share)
        if each.share > (LOAD if loads else MASS):
            share = f"up to {_percent(each.share)}" if loads else f"up to {significant(each.size, 2)} kg"
            share += "" if loads else f" ({_percent(each.share)})"
            what = "all loads" if loads else f"the mass of the link of {owner}"
            parts.append(f"{what} by {'anything' if all_of_it else share}")
    gains = any(p.name.rpartition(".")[2] == seen.robot.drive_gain for p in seen.parameters)
    said = [
        scale,
        f"{'Friction is known; masses' if all_rigid(seen.robot) else 'Masses'} and loads are those of the URDF and of "
        "/load, and these rests would not show it "
        f"if one of them were off alone: {', '.join(parts)}" * bool(parts),
        "Torque constants are on the scale of masses and loads: all of these off by one share would not show"
        * (gains and bool(seen.unnoticed)),
        "More postures and weights, with every joint moved before each rest, show more" * bool(parts),
    ]
    return ". ".join(filter(None, said))


def _on_one_scale(share: float) -> str:
    """What all weights off by one share would do to springs, whose sigmas know nothing of it."""
    by = "any share" if np.isinf(share) else f"one share of up to {_percent(share)}"
    return (
        f"Springs and friction are on the scale of masses and loads: all of these off by {by} would not show, and "
        "change springs by as much"
    )


def _percent(share: float) -> str:
    return f"{significant(100.0 * share, 2)} %"
