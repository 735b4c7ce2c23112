# SPDX-License-Identifier: BSD-3-Clause
"""Whether values would be others with an effect that the model lacks: no residual need show it, a score test does."""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.rests.rests_beside_motion import seen_rests
from jointscope.graphs.scoring.lacking_effects import AS_SURE, LackingEffect
from jointscope.graphs.scoring.regression.load_friction import LoadFriction
from jointscope.graphs.scoring.regression.regressed_causes import RegressedCause
from jointscope.graphs.scoring.regression.ripples import EFFECT as RIPPLE
from jointscope.graphs.scoring.regression.unsteady_gains import (
    BEYOND,
    COMMAND,
    COMMANDS,
    FRICTION,
    SPEED,
    SPEEDS,
    TIME,
    UnsteadyGain,
)
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.tools.presentation.left_out import recording_arguments
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.verdicts.given_recordings import given
from jointscope.tools.verdicts.same_time import same_time, would_be

MEASURED = "Record the effort that the drives report, measured currents or torques, instead of commands"
FALLS_WITH = {  # how a gain falls, with what reason, and what helps
    SPEED: ("the faster the joint goes", "a voltage that its back-EMF uses up, or a supply that sags", MEASURED),
    SPEEDS: ("the faster all joints go", "a supply that sags", MEASURED),
    COMMAND: ("the more is commanded", "a motor that saturates, or a supply that sags", MEASURED),
    COMMANDS: ("the more all drives are asked for", "a supply that sags", MEASURED),
    TIME: (
        "as time goes by",
        "a motor that warms, or a battery that runs down",
        "Record when it is warm, or calibrate shorter recordings one by one",
    ),
    BEYOND: ("the more is commanded beyond a level", "a motor that saturates", MEASURED),
    FRICTION: ("as time goes by", "a lubricant that warms", "Record when it is warm, or shorter recordings one by one"),
}
MOST_ALIKE = 2
MOST_CHANGES = 3
LATE = ("command_delay", "motor_lag")  # effects that are said of the stamps, too
MATTERS = 0.01  # of the rms torque of a drive that an effect explains, from which values cannot be relied on


def missing_effects(result: CalibrationResult) -> tuple[str, str]:
    """A level of `judgement.LEVELS` and a sentence."""
    if result.robot.free_links:
        return "info", "Without masses this cannot be checked."
    if given(result):
        return "info", "That cannot be judged as long as drives saturate, a load changes, or samples are too rare."
    if result.asked.link:
        return "info", "That cannot be judged as long as the mass of a link differs from the URDF's."
    if result.asked.causes:
        return _named(result)
    if result.asked.gains:
        return "bad", _falling_gains(result)
    if result.asked.load_frictions:
        return "bad", _growing_friction(result)
    found = result.found
    asked = [(effect, shares) for effect in result.lacking if (shares := effect.moved(found))]
    within = [(effect, shares) for effect in result.lacking if (shares := effect.moved(found, sigmas=0.0))]
    if not within:
        return "good", "None of the catalogue, as far as one step with each can tell."
    first, shares = (asked or within)[0]
    if first.effect in LATE and same_time(result)[0] in ("warn", "bad"):
        return (
            "info",
            "What looks like a late drive signal here is said above; the rest can be judged once that is fixed.",
        )
    worst = max(shares, key=lambda name: abs(first.with_it[name] - found[name].value) / found[name].sigma)
    others = [e.label for e in result.lacking if e is not first and e.p_value <= AS_SURE * first.p_value]
    alike = f" (or {' or '.join(others[:MOST_ALIKE])}, which may look alike)" if others else ""
    covered = "" if asked else ", which its sigma covers"
    return "bad" if asked else "warn", (
        f"The recording calls for {first.label}, {catalogue()[first.effect].card.title}{alike}: with it "
        f"{_change(result, first, worst)}{covered}. {_next(result, first)}."
    )


def _named(result: CalibrationResult) -> tuple[str, str]:
    """Effects that regression names and the calibration asks for: they are what is missing, or look like it."""
    causes, catalogued = result.asked.causes, catalogue()
    by_effect: dict[str, list[RegressedCause]] = {}
    for cause in causes:
        by_effect.setdefault(cause.effect, []).append(cause)
    listed = " and ".join(
        f"{', '.join(c.label for c in some)}, {catalogued[effect].card.title}{_alike(some)}"
        for effect, some in by_effect.items()
    )
    worst = max(causes, key=lambda cause: cause.size)
    labels, output = " ".join(c.label for c in causes), edited_argument(result.start, next(iter(by_effect)))
    add = (
        f"Add it: `jointscope add {robot_argument(result.start)} {labels} -o {output}`, then calibrate again."
        if RIPPLE not in by_effect  # whose order a search finds
        else f"Which it is exactly, and whether it predicts better: `{_discover(result)}`."
    )
    return "bad" if worst.size > MATTERS else "warn", (
        f"The recording asks for {listed}: at {worst.joint} {100.0 * worst.explained:.0f} % of what regression leaves "
        f"open is of its shape, {significant(100.0 * worst.size, 2)} % of the drive's torque{_moved(causes)}. {add}"
    )


def _falling_gains(result: CalibrationResult) -> str:
    """Gains that fall, which no effect of the catalogue knows: what it does to the values, and what is left to do."""
    told = result.asked.gains
    listed = ", ".join(
        f"{one.joint} ({_beyond(result, one)}{significant(100.0 * one.lost, 2)} ± "
        f"{significant(100.0 * one.sigma, 1)} % at the most)"
        for one in told
    )
    what, reason, cure = FALLS_WITH[told[0].form]
    loses = "friction falls" if told[0].form == FRICTION else "a unit of the command makes less torque"
    return (
        f"By regression {loses} {what}, at {listed}: {reason}. With it about "
        f"{_factors(result, told)}. No effect of the catalogue knows this. {cure}, then calibrate again."
    )


def _beyond(result: CalibrationResult, one: UnsteadyGain) -> str:
    """The level from which a gain falls, in words; nothing where there is none."""
    return f"beyond {significant(one.level)} {result.robot.command.unit}, " if one.level else ""


def _factors(result: CalibrationResult, told: Sequence[UnsteadyGain] | Sequence[LoadFriction]) -> str:
    """The values that change most, as they would be and as they are."""
    found = result.found
    factors = {n: f for one in told for n, f in one.with_it.items() if n in found}
    return "; ".join(
        f"{name} {significant(factor * found[name].value)} instead of {significant(found[name].value)}"
        for name, factor in sorted(factors.items(), key=lambda item: -abs(item[1] - 1.0))[:MOST_CHANGES]
    )


def _growing_friction(result: CalibrationResult) -> str:
    """Friction that no effect of rigid joints knows: what it does to the values, and what is left to do."""
    told = result.asked.load_frictions
    shares = [(one.joint, significant(100.0 * one.share, 2), significant(100.0 * one.sigma, 1)) for one in told]
    listed = ", ".join(f"{joint} ({share} ± {sigma} % of it)" for joint, share, sigma in shares)
    return (
        f"By regression the dry friction of {listed} grows with the torque that the drive passes on, as that of gears "
        f"does; with it {_factors(result, told)}. Effects of rigid joints know friction that grows with the weight "
        f"alone. Which comes nearest: `{_discover(result)}`."
    )


def _alike(causes: Sequence[RegressedCause]) -> str:
    others = list(dict.fromkeys(effect for cause in causes for effect in cause.alike))
    return f" (or {' or '.join(others[:MOST_ALIKE])}, which looks alike here)" if others else ""


def _moved(causes: Sequence[RegressedCause]) -> str:
    """The value that changes most, in words; nothing where none changes by much."""
    factors = {name: factor for cause in causes for name, factor in cause.with_it.items()}
    if not factors:
        return ""
    name = max(factors, key=lambda n: abs(factors[n] - 1.0))
    return f", and with it {name} would be {100.0 * (factors[name] - 1.0):+.0f} %"


def _next(result: CalibrationResult, effect: LackingEffect) -> str:
    """What to type: an effect that was tried need not be looked for."""
    if effect.tried:
        output = edited_argument(result.start, effect.effect)
        return (
            f"Add it: `jointscope add {robot_argument(result.start)} {effect.label} -o {output}`, then calibrate again"
        )
    return f"Which it is, and whether it predicts better: `{_discover(result)}`"


def _discover(result: CalibrationResult) -> str:
    """The command that looks for effects, with a part of one recording, or the last of several, held out."""
    start, recordings = result.start, [bag.recording for bag in result.bags]
    if len(recordings) > 1:
        held = f"{recording_arguments(recordings[:-1])} --holdout {recording_arguments(recordings[-1:])}"
    else:
        held = f"{recording_arguments(recordings)} --holdout-share 0.33"
    if seen := seen_rests(result):
        held += f" {seen.option}"
    return f"jointscope discover {robot_argument(start)} {held} -o {edited_argument(start, 'better')}"


def _change(result: CalibrationResult, effect: LackingEffect, name: str) -> str:
    """What a value would be; a step that is very long only says that it would be another."""
    unit = next(p.unit for p in result.parameters if p.name == name)
    return would_be(name, result.found[name].value, effect.with_it[name], unit)
