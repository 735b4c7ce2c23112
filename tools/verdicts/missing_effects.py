# SPDX-License-Identifier: BSD-3-Clause
"""Whether values would be others with an effect that the model lacks: no residual need show it, a score test does."""

from __future__ import annotations

import shlex

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.scoring.lacking_effects import AS_SURE, LackingEffect
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.tools.verdicts.one_step import would_be

MOST_ALIKE = 2


def missing_effects(result: CalibrationResult) -> tuple[str, str]:
    """A level of `judgement.LEVELS` and a sentence."""
    if result.robot.free_links:
        return "info", "Without masses this cannot be checked."
    found = result.found
    asked = [(effect, shares) for effect in result.lacking if (shares := effect.moved(found))]
    within = [(effect, shares) for effect in result.lacking if (shares := effect.moved(found, sigmas=0.0))]
    if not within:
        return "good", "None of the catalogue, as far as one step with each can tell."
    first, shares = (asked or within)[0]
    worst = max(shares, key=lambda name: abs(first.with_it[name] - found[name].value) / found[name].sigma)
    others = [e.label for e in result.lacking if e is not first and e.p_value <= AS_SURE * first.p_value]
    alike = f" (or {' or '.join(others[:MOST_ALIKE])}, which may look alike)" if others else ""
    covered = "" if asked else ", which its sigma covers"
    return "bad" if asked else "warn", (
        f"The recording asks for {first.label}, {catalogue()[first.effect].card.title}{alike}: with it "
        f"{_change(result, first, worst)}{covered}. {_next(result, first)}."
    )


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
    start, bags = result.start, [shlex.quote(bag.recording.path) for bag in result.bags] or ["BAG"]
    *learnt, last = bags
    held = f"{' '.join(learnt)} --holdout {last}" if learnt else f"{last} --holdout-share 0.33"
    return f"jointscope discover {robot_argument(start)} {held} -o {edited_argument(start, 'better')}"


def _change(result: CalibrationResult, effect: LackingEffect, name: str) -> str:
    """What a value would be; a step that is very long only says that it would be another."""
    unit = next(p.unit for p in result.parameters if p.name == name)
    return would_be(name, result.found[name].value, effect.with_it[name], unit)
