# SPDX-License-Identifier: BSD-3-Clause
"""Effects that a robot file has and a simulation of it has not: which, and what to type to have them simulated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.effects import simulated_effects
from jointscope.tools.simulator.world.not_simulated import NOT_SIMULATED


def not_simulated(robot: Robot, truth: Mapping[str, Any]) -> dict[str, Any]:
    """What of a robot file was left out, fit for JSON.

    Args:
        robot: as its file has it.
        truth: of the simulation, with its `effects`.

    Returns:
        `not_simulated`: all labels; `to_simulate_them`: options of the command line for those that can be simulated, at
        their values in the file; `cannot_be_simulated`: reasons by label for the others.
    """
    simulated = {f"{effect['effect']}@{effect['owner']}" for effect in truth["effects"]}
    left = [here for here in robot.effects if here.label not in simulated]
    can = [here for here in left if here.effect.id in simulated_effects()]
    never = "the simulator has no such effect"
    return {
        "not_simulated": [here.label for here in left],
        "to_simulate_them": " ".join(_option(here, robot) for here in can),
        "cannot_be_simulated": {
            here.label: NOT_SIMULATED.get(here.effect.id, never) for here in left if here not in can
        },
    }


def not_simulated_text(found: Mapping[str, Any]) -> str:
    """The same in a line or two for the screen, each indented; empty where nothing was left out."""
    if not found["not_simulated"]:
        return ""
    options, reasons = found["to_simulate_them"], found["cannot_be_simulated"]
    lines = [f"  not simulated, although in the robot file: {', '.join(found['not_simulated'])}"]
    if options:
        lines[0] += f"; name them: {options}"
    lines += [f"  cannot be simulated: {label}: {reason}" for label, reason in reasons.items()]
    return "\n".join(lines)


def _option(here: EffectAt, robot: Robot) -> str:
    """What the command line would say to simulate an effect of the robot file at its value there."""
    values = here.own(robot.values)
    sizes = ",".join(f"{name}={value:.6g}" for name, value in values.items())
    return f"--effect {here.label}{':' if sizes else ''}{sizes}"
