# SPDX-License-Identifier: BSD-3-Clause
"""The effects that can be simulated, one file each; a new file is found by being here."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Iterable
from functools import cache

from jointscope.robots.errors import EffectError
from jointscope.robots.files.effect_catalogue import without_alias
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.world.effect import SimulatedEffect, owners_of
from jointscope.tools.simulator.world.not_simulated import NOT_SIMULATED


@cache
def simulated_effects() -> dict[str, type[SimulatedEffect]]:
    """All effects of this folder by id."""
    found: dict[str, type[SimulatedEffect]] = {}
    for module_info in sorted(pkgutil.iter_modules(__path__), key=lambda info: info.name):
        module = importlib.import_module(f"{__name__}.{module_info.name}")
        for _, member in inspect.getmembers(module, inspect.isclass):
            if issubclass(member, SimulatedEffect) and member.__module__ == module.__name__:
                found[member.id] = member
    return found


def make_effect(text: str, robot: Robot) -> SimulatedEffect:
    """An effect from its text ID@OWNER[:param=value,...].

    Args:
        text: for example "bearing_flexibility@joint1:damping_x=10,damping_y=12".
        robot: the robot with its true parameters.

    Returns:
        The effect, ready to be built into a simulation.

    Raises:
        EffectError: unknown id, owner or parameter, or text of another form.
    """
    head, _, tail = text.partition(":")
    effect_id, at, owner = without_alias(head).partition("@")
    known = simulated_effects()
    if effect_id in NOT_SIMULATED:
        raise EffectError(f"effect {effect_id} cannot be switched on: {NOT_SIMULATED[effect_id]}")
    if effect_id not in known:
        raise EffectError(f"effect {effect_id!r} cannot be simulated; known are {', '.join(known)}")
    if not at or not owner:
        example = f"{effect_id}@{next(iter(owners_of(known[effect_id].acts_on[0], robot)), 'JOINT')}"
        raise EffectError(f"effect {text!r}: expected ID@OWNER[:param=value,...], for example {example}")
    return known[effect_id](owner, parameters_in(text, tail), robot)


def make_effects(texts: Iterable[str], robot: Robot) -> list[SimulatedEffect]:
    """Effects from their texts, see `make_effect`.

    Raises:
        EffectError: also if an effect is given twice for one owner.
    """
    effects: list[SimulatedEffect] = []
    for text in texts:
        effect = make_effect(text, robot)
        if any((effect.id, effect.owner) == (other.id, other.owner) for other in effects):
            raise EffectError(f"effect {effect.id}@{effect.owner} is given twice; give all its parameters at once")
        effects.append(effect)
    return effects


def parameters_in(text: str, tail: str) -> dict[str, float]:
    """Sizes from param=value,... behind the colon of an effect's text.

    Raises:
        EffectError: a value that is no number.
    """
    parameters: dict[str, float] = {}
    for item in filter(None, tail.split(",")):
        name, _, number = item.partition("=")
        try:
            parameters[name.strip()] = float(number)
        except ValueError as err:
            raise EffectError(f"effect {text!r}: expected param=number, got {item!r}") from err
    return parameters
