# SPDX-License-Identifier: BSD-3-Clause
"""Is a calibration from rests good, and for what? One sentence, with what to do where it is not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from jointscope.graphs.calibration.calibration_result import ParameterEstimate
from jointscope.graphs.rest_sets.rest_errors import SURELY
from jointscope.graphs.rests.calibrate_rests import RestCalibration
from jointscope.graphs.rests.doubts import PLACE, Doubt
from jointscope.graphs.rests.seen_rests import SeenRests
from jointscope.graphs.rests.taken_for_granted import all_rigid
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.parts.relative_sigma import relative_sigma
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.verdicts.rests.not_told import from_one_side, open_gains, standing, unchecked

LOOSE = 0.25  # sigma of a value above zero, over it, from which it is hardly known
AS_EXPECTED, DOUBTFUL = 1.3, 2.0  # [sigma] error of rests that sensors explain, and that they do not
WIDENED, FAR = 1.5, 3.0  # times that sigmas of link encoders were widened: more than they may repeat, and no noise
FOLLOWS, BY_CHANCE = 0.1, 1e-5  # share of what friction holds that weights explain, and how likely by chance
NO, USABLE = "No, do not rely on this yet", "Usable, with reservations"
SO = {"bad": NO, "warn": USABLE}
BEYOND = 0.1  # of its band, that friction may have to hold beyond it
SURE = 1e-3  # probability by chance, from which a doubt is none any more
NEAR = 10.0  # chi2 by which others may fall less and be named as well
MOST = 3
FINE = 0.02  # share that takes three digits


def verdict(result: RestCalibration) -> str:
    """Whether the model holds at rest, and whether the rests tell its values."""
    seen = result.seen
    level, said = contradiction(seen)
    if said:
        return f"{SO[level]}: {said}."
    for owner, values in Counter(p.name.split(".")[0] for p in result.parameters).most_common(1):
        if result.count <= values:
            few = f"{counted(result.count, 'rest')} for {values} values of {owner}"
            return f"{NO}: {few}; nothing could contradict them."
    level, said = hardly_told(result)
    if said and not result.parameters:
        return f"{SO[level]}: {said}."
    if doubt := open_gains(seen):
        return f"{USABLE}: {doubt}."
    silent = standing(seen) or from_one_side(seen)
    if said:
        return f"{SO[level]}: {said}{silent and f'; {silent}'}."
    if silent:
        return f"{USABLE}: {silent}."
    if result.errors.error > AS_EXPECTED or widened(seen)[1] > WIDENED:
        return f"{USABLE}: links rest further from where the model says than their encoders explain."
    limits = unchecked(seen)
    return f"Yes, the model holds at these rests{f', as far as they tell. {limits}' if limits else ''}."


def hardly_told(result: RestCalibration) -> tuple[str, str]:
    """Level of `judgement.LEVELS` and values that are hardly known; empty where all are known."""
    seen, values_of = result.seen, result.robot.parameters
    if not result.parameters and len(seen.stood) == len(result.robot.joints):
        return "bad", f"these rests determine no value; {standing(seen)}"
    told = [p for p in result.parameters if values_of[p.name].positive and values_of[p.name].null is None]
    loose = [p for p in told if p.sigma > LOOSE * p.value]
    if not loose:
        return "good", ""
    names = ", ".join(f"{p.name} ({relative_sigma(p.sigma / abs(p.value))})" for p in loose)
    level = "bad" if len(loose) == len(told) else "warn"
    return level, f"these rests hardly determine {names}; let it rest {_more(result, loose)}"


def contradiction(seen: SeenRests) -> tuple[str, str]:
    """Level of `judgement.LEVELS` and what rests say against the model; empty where they say nothing."""
    if seen.errors.error > DOUBTFUL:
        return "bad", "links do not rest where the model says"
    if doubt := _following(seen):
        return "bad", doubt
    misfit, (level, doubt) = _misfit(seen), doubts_said(seen)
    if misfit and not (doubt and all_rigid(seen.robot)):  # far from the data everything helps springs that lack a law
        return "bad", f"{misfit}; something is missing: {_diagnosis(seen)}"
    return level, doubt


def _more(result: RestCalibration, loose: Sequence[ParameterEstimate]) -> str:
    """How many rests more would tell loose values: edges of a band are known as well as rests lie apart in it."""
    times = max(p.sigma / p.value for p in loose) / LOOSE
    more = int(np.ceil((times - 1.0) * result.count))
    return f"about {counted(more, 'time')} more, in other postures or with other weights"


def widened(seen: SeenRests) -> tuple[str, float]:
    """The joint whose link encoder repeats worst, and its sigma over the stated one."""
    scale = seen.problems[0].repeatability
    j = int(scale.argmax())
    return seen.robot.joints[j], float(scale[j])


def _misfit(seen: SeenRests) -> str:
    """Links far from where the model has them, friction far beyond its band; empty where noise explains all."""
    joint, times = widened(seen)
    if times > FAR:
        return (
            f"{joint} rests {significant(times, 2)} sigmas of its encoder away, and its sigma was widened by as much "
            "to go on, unless other loads hung there than /load says"
        )
    bands, rigid = seen.errors.bands, all_rigid(seen.robot)
    for j, joint in enumerate(seen.robot.joints):
        beyond = float(seen.errors.certain[:, j].max(initial=0.0))
        # friction of a rigid joint is that of any masses and loads that these might be instead, as well as it is known
        known = sum(p.sigma for p in seen.parameters if p.name.startswith(f"{joint}.")) if rigid else 0.0
        if beyond > BEYOND * bands[j] + SURELY * known:
            return (
                f"friction of {joint} would have to hold {significant(1e3 * beyond, 2)} mN m beyond a band of "
                f"{significant(1e3 * bands[j], 2)} mN m"
            )
        creeping = float(seen.errors.off_creeping[j])
        if creeping > BEYOND * bands[j]:
            return (
                f"friction of {joint} is {significant(1e3 * creeping, 2)} mN m (rms) off a band of "
                f"{significant(1e3 * bands[j], 2)} mN m where it creeps, as if it depended on speed or place"
            )
    return ""


def _following(seen: SeenRests) -> str:
    """A rigid joint whose friction holds what loads and gravity say; empty where none does."""
    for j, joint in enumerate(seen.robot.joints):
        share, chance = seen.errors.following(j)
        if share > FOLLOWS and chance < BY_CHANCE:
            return (
                f"{significant(100 * share, 2)} % of what friction of {joint} has to hold goes with loads and gravity, "
                "of which friction knows nothing: /load has another sign, unit or frame, a mass is another, or the "
                "joint was not moved as weights changed"
            )
    return ""


def _diagnosis(seen: SeenRests) -> str:
    """The command that looks for it."""
    return f"`jointscope diagnose {robot_argument(seen.start)} {seen.option}`"


def doubts_said(seen: SeenRests) -> tuple[str, str]:
    """Level of `judgement.LEVELS` and sentence where rests ask for another model; empty where they do not."""
    if not seen.doubts:
        return "good", ""
    first, sides = seen.doubts[0], from_one_side(seen)
    named = [d for d in seen.doubts if d.fall > first.fall - NEAR][:MOST]
    return "bad" if first.p_value < SURE else "warn", (
        f"these rests are far likelier (chi2 falls by {significant(first.fall, 2)}, {_chance(first.p_value)}) if "
        f"{', or '.join(_said(doubt) for doubt in named)}{sides and f'; {sides}'}; {_next(seen, named)}"
    )


def _chance(p_value: float) -> str:
    return f"p = {p_value:.0e}" if p_value > 0.0 else "p < 1e-300"


def _said(doubt: Doubt) -> str:
    effect, _, owner = doubt.label.partition("@")
    return {
        "load_scale": f"loads are {1.0 + doubt.size:.{3 if abs(doubt.size) < FINE else 2}f} of what /load says",
        "link_mass": f"the link of {owner} weighs something else, or elsewhere",
        "encoder_offset": f"the zero of {owner} is another",
        "torque_offset": f"a constant torque acts at {owner}, as weight does",
        "load_dependent_friction": f"friction of {owner} grows with what it carries",
        PLACE: f"friction of {owner} is not the same at all angles",
    }[effect]


def _next(seen: SeenRests, named: list[Doubt]) -> str:
    """What to do about it."""
    if all(doubt.label.startswith(PLACE) for doubt in named):
        return "nothing in the catalogue holds that: calibrate from rests near the postures that you need"
    return f"weigh, correct, and calibrate again; {_diagnosis(seen)} ranks what may be missing"
