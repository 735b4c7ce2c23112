# SPDX-License-Identifier: BSD-3-Clause
"""What a step of the search changed, in plain words: the size that was found, and what is left of its equations."""

from __future__ import annotations

from collections.abc import Mapping

from jointscope.graphs.transmission.candidates import Candidate
from jointscope.graphs.transmission.transmission_model import TransmissionModel, with_found_effects
from jointscope.robots.files.effect_catalogue import catalogue

MILLI = 1e3
SPRING = "joint_elasticity"

Errors = Mapping[str, float]


def what_changed(
    added: Candidate,
    model: TransmissionModel,
    sigmas: Mapping[str, float],
    units: Mapping[str, tuple[float, str]],
    errors: tuple[Errors, Errors],
    where: str,
) -> str:
    """Sentences about one step.

    Args:
        added: the effect.
        model: with it.
        sigmas: standard deviations of the model's columns, by name.
        units: sigma and unit of the equations that it acts in, by name.
        errors: of each equation without it and with it [sigma].
        where: "the held-out recording" or "the training recordings".
    """
    before, after = errors
    falls = [
        f"{name} {MILLI * before[name] * sigma:.3g} to {MILLI * after[name] * sigma:.3g} m{unit}"
        for name, (sigma, unit) in units.items()
    ]
    title = catalogue()[added.effect].card.title
    sizes = _sizes(added, model, sigmas)
    return f"{title[0].upper()}{title[1:]}, {added.owner}: {sizes}. Left on {where}: {', '.join(falls)}."


def _sizes(added: Candidate, model: TransmissionModel, sigmas: Mapping[str, float]) -> str:
    robot, said = with_found_effects(model, sigmas), []
    for name in added.sizes:
        found = robot.parameters[name]
        text = f"{name.rsplit('.', 1)[1]} {found.value:.3g}"
        text += f" +- {found.sigma:.1g} {found.unit}" if found.sigma is not None else f" {found.unit}"
        said.append(text.removesuffix(" 1"))
        if added.effect == SPRING and found.value > 0.0:
            said[-1] += f", a stiffness of {1.0 / found.value:.3g} {robot.unit_at(added.owner, 'N m/rad')}"
    return ", ".join(said)
