# SPDX-License-Identifier: BSD-3-Clause
"""Adds effects to a robot and takes them away again; the robot's document changes with it, its comments stay."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from jointscope.robots.effect_kinds.effect import EffectParameter
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.joint_torque import JointTorque
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.errors import EffectError
from jointscope.robots.files.effect_catalogue import catalogue, parse_effect, without_alias
from jointscope.robots.files.needed_spring import effects_of_spring, is_spring, needed_spring
from jointscope.robots.files.sections.noise_section import (
    HINGE_DENSITY,
    HINGE_LASTING,
    smallest_densities,
    unseen_links,
)
from jointscope.robots.files.yaml_comments import empty_at, remove_at
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.process_noise import ProcessNoise

BEST_INTEGRATOR = "simpson"


def add_effect(robot: Robot, label: str, start: dict[str, float] | None = None) -> Robot:
    """A robot with one more effect, at its start values.

    Args:
        robot: the robot.
        label: ID@OWNER.
        start: other start values, by the last part of the parameter's name.

    Raises:
        EffectError: unknown effect or owner, the effect is there already, or the model has it by itself.
        RobotError: the robot file describes poses alone.
    """
    robot.need_motion()
    effect, owner = parse_effect(label, robot)
    here = EffectAt(effect, owner)
    if robot.has_effect(effect.id, owner):
        raise EffectError(f"{robot.name} has {label} already; remove it first, or calibrate")
    why_not = cannot_be_added(robot, here)
    if why_not:
        raise EffectError(f"{label} cannot be added to {robot.name}: {why_not}")
    if isinstance(effect, Structure) and effect.form == "integration":
        return _better_integrated(robot)
    parameters = dict(robot.parameters)
    document = copy.deepcopy(robot.document)
    document.setdefault("effects", CommentedSeq()).append(here.label)
    document.setdefault("parameters", CommentedMap())
    for p in effect.parameters_at(robot, owner):
        parameter = parameter_of(here, p, (start or {}).get(p.name, p.start))
        # knots that nobody chose are placed where the recordings of a calibration deflect the spring
        parameter = replace(parameter, fixed=p.held and p.name in (start or {}))
        parameters[parameter.name] = parameter
        document["parameters"][parameter.name] = _entry(parameter)
    new = replace(robot, parameters=parameters, effects=(*robot.effects, here), document=document)
    return replace(new, noise=carried_noise(robot, new))


def _better_integrated(robot: Robot) -> Robot:
    """The robot with the best integrator: what integration_error adds."""
    document = copy.deepcopy(robot.document)
    document.setdefault("model", CommentedMap())["integrator"] = BEST_INTEGRATOR
    return replace(robot, choices=replace(robot.choices, integrator=BEST_INTEGRATOR), document=document)


def remove_effect(robot: Robot, label: str) -> Robot:
    """A robot without one of its effects, and without the derived results that follow from it.

    Raises:
        EffectError: the robot does not have it, another effect needs it, or it is a choice of the model and no entry.
    """
    label = without_alias(label)
    gone = [here for here in robot.effects if here.label == label]
    if not gone:
        raise EffectError(_why_not_removed(robot, label))
    held = effects_of_spring(robot, gone[0]) if is_spring(gone[0]) else ()
    if held:
        raise EffectError(
            f"{label} cannot be removed from {robot.name}: {', '.join(held)} acts in that spring; remove both: "
            f"jointscope remove {robot_argument(robot)} {' '.join(held)} {label} "
            f"-o {edited_argument(robot, 'without')}"
        )
    document = copy.deepcopy(robot.document)
    remove_at(document, "effects", [without_alias(str(text)) for text in document["effects"]].index(label))
    start = gone[0].parameter("")
    parameters = {name: p for name, p in robot.parameters.items() if not name.startswith(start)}
    for name in robot.parameters:
        if name.startswith(start) and name in document["parameters"]:
            _take_out_parameter(document, name)
    effects = tuple(here for here in robot.effects if here.label != label)
    follows = [result for result in robot.derived if set(result.of) - parameters.keys()]
    for result in follows:
        remove_at(document, "derived", result.name)
    derived = tuple(result for result in robot.derived if result not in follows)
    new = replace(robot, parameters=parameters, effects=effects, derived=derived, document=document)
    by_name = set(new.layout.links) - set(new.layout.joints) | set(new.memories)
    if not by_name and "effects" in document.get("noise", {}):
        remove_at(document, "noise", "effects")
    return replace(new, noise=carried_noise(robot, new))


def _take_out_parameter(document: CommentedMap, name: str) -> None:
    """Removes a parameter; a robot file has the section also where nothing is left in it."""
    if len(document["parameters"]) > 1:
        remove_at(document, "parameters", name)
    else:
        empty_at(document, "parameters")


def _why_not_removed(robot: Robot, label: str) -> str:
    """What to tell about an effect that is not among those of the robot."""
    effect_id, _, owner = label.partition("@")
    effect = catalogue().get(effect_id)
    of_integrator = isinstance(effect, Structure) and effect.form == "integration" and owner in effect.owners_of(robot)
    if of_integrator and robot.choices.integrator == BEST_INTEGRATOR:
        return (
            f"{label} is not listed under effects of {robot.name}: adding it only sets "
            f"`model: integrator: {BEST_INTEGRATOR}`; to go back, set the integrator in {robot.path.name} "
            "to what it was (euler or midpoint)"
        )
    known = ", ".join(here.label for here in robot.effects) or "none"
    return f"{robot.name} does not have the effect {label!r}; it has {known}"


def cannot_be_added(robot: Robot, here: EffectAt) -> str:
    """Why an effect makes no sense in this model; empty if it does."""
    effect, owner = here.effect, here.owner
    why_not = effect.may_act_on(robot, owner)
    if why_not:
        return why_not
    if isinstance(effect, Structure) and effect.form == "integration" and robot.choices.integrator == BEST_INTEGRATOR:
        return f"the model has the best integrator, {BEST_INTEGRATOR}, already"
    spring = needed_spring(robot, here)
    if spring:
        return f"{owner} is rigid and has no spring; add {spring} first"
    gap = next((other for other in robot.effects if other.owner == owner and _leaves_gap(other)), None)
    if gap is not None and _leaves_gap(here) and gap.effect.id != effect.id:
        return f"{gap.label} is the dead zone of its spring already; remove that first"
    curve = next((other for other in robot.effects if other.owner == owner and _two_curves(other, here)), None)
    if curve is not None:
        return f"{curve.label} is the curve of its spring already; remove that first"
    return ""


def _leaves_gap(here: EffectAt) -> bool:
    """Whether an effect is a dead zone in front of a spring."""
    return isinstance(here.effect, JointTorque) and bool(here.effect.gap)


def _two_curves(a: EffectAt, b: EffectAt) -> bool:
    """Whether two different effects bend the same spring and one of them is its whole curve."""
    if not isinstance(a.effect, JointTorque) or not isinstance(b.effect, JointTorque) or a.effect.id == b.effect.id:
        return False
    return bool(a.effect.curve and b.effect.curve) and "whole" in (a.effect.curve, b.effect.curve)


def parameter_of(here: EffectAt, p: EffectParameter, value: float) -> Parameter:
    """A parameter of an added effect: prior about the null value, or about the start where it has none.

    The shape of a law (the order of a ripple) was chosen among several: its prior is about the chosen value.
    """
    chosen = p.is_shape and not isinstance(here.effect, Structure)
    centre = value if chosen else p.start if p.is_shape or p.logarithmic else p.null
    return Parameter(
        name=here.parameter(p.name),
        value=value,
        unit=p.unit,
        prior=centre,
        prior_sigma=p.prior_sigma,
        positive=p.logarithmic,
        fixed=p.held,
        effect=here.effect.id,
        null=None if p.is_shape else p.null,
    )


def carried_noise(old: Robot, new: Robot) -> ProcessNoise:
    """Process noise of a robot in the layout of another one."""
    before, after, noise = old.layout, new.layout, old.noise
    link = dict(zip(before.links, noise.link_velocity, strict=True))
    motor = dict(zip(before.motors, noise.motor_velocity, strict=True))
    memory = dict(zip(old.memories, noise.white.memory, strict=True))
    white = replace(
        noise.white,
        link_velocity=np.array([link.get(name, HINGE_DENSITY) for name in after.links]),
        motor_velocity=np.array([motor.get(name, link.get(name, HINGE_DENSITY)) for name in after.motors]),
        memory=np.array([memory.get(label, m.noise) for label, m in new.memories.items()]),
        smallest=smallest_densities(new),
        unseen=unseen_links(new),
    )
    if not noise.n_lasting:
        return white
    lasting = dict(zip(before.rate_names, noise.lasting, strict=False))
    sizes = [lasting.get(name, HINGE_LASTING) for name in after.rate_names[: after.n_link + after.n_motor]]
    return white.with_lasting(noise.correlation_time, np.array(sizes))


def _entry(parameter: Parameter) -> CommentedMap:
    entry = CommentedMap({"value": parameter.value, "unit": parameter.unit, "prior": parameter.prior})
    entry["prior_sigma"] = parameter.prior_sigma
    if not parameter.positive:
        entry["positive"] = False
    if parameter.fixed:
        entry["fixed"] = True
    if parameter.null is not None:
        entry["null"] = parameter.null
    entry.fa.set_flow_style()
    return entry
