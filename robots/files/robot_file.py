# SPDX-License-Identifier: BSD-3-Clause
"""Robot files: YAML in, Robot out, and back again with all comments.

Ready robots are the YAML files below `robots/`; every other name is a path.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.errors import EffectError, RobotError
from jointscope.robots.files.effect_catalogue import parse_effect
from jointscope.robots.files.robot_consistency import check_robot
from jointscope.robots.files.sections.derived_section import derived_results
from jointscope.robots.files.sections.frequency_section import check_still_parameters, frequency_setup
from jointscope.robots.files.sections.locked_section import check_locked_springs
from jointscope.robots.files.sections.noise_section import noise_of, process_noise
from jointscope.robots.files.sections.pose_section import pose_setup, with_poses
from jointscope.robots.files.sections.sensor_sections import sensor, topic
from jointscope.robots.files.sections.transmission_section import transmission_matrix
from jointscope.robots.model.command_words import READY_ROOT, ready_robots
from jointscope.robots.model.robot import Robot
from jointscope.robots.model.tracker_frames import with_trackers
from jointscope.robots.parts.model_choices import ModelChoices
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.position_controller import PositionController, position_controller
from jointscope.robots.parts.process_noise import ProcessNoise
from jointscope.robots.parts.sensors import Topic
from jointscope.robots.yaml_document import read_document
from jointscope.robots.yaml_section import Section, did_you_mean

FORMAT = 1
READY_PREFIX = "ready:"

INTEGRATORS = ("euler", "midpoint", "simpson")
COMMAND_UNITS = ("duty", "V", "A", "N m")
NO_COMMAND = Topic("", "", "", "N m")  # of a robot of which only poses are measured
CONSTANTS = ("motor.supply_voltage", "motor.gear")


def load_robot(name_or_path: str | Path) -> Robot:
    """Reads a robot.

    Args:
        name_or_path: name of a ready robot, or path of a robot file.

    Returns:
        The robot.

    Raises:
        RobotError: no such robot, not YAML, unknown keys, wrong types, impossible values.
    """
    path = _find(str(name_or_path))
    document = read_document(path)
    top = Section(document, path.name)
    format_number = top.number("format")
    if format_number != FORMAT:
        raise RobotError(f"{path.name}: format {format_number:g} is not known; this version reads format {FORMAT}")
    joints = top.texts("joints")
    if len(set(joints)) != len(joints) or not joints:
        raise RobotError(f"{path.name}: joints: expected different names, got {', '.join(joints) or 'none'}")
    choices = top.section("model", {}).build(lambda s: _model_choices(s, joints))
    gravity = top.array("gravity", (3,))
    motion = not {"poses", "frequency"} & set(top.keys()) or "command" in top or "sensors" in top
    urdf, masses = _urdf_path(top.text("urdf"), path), motion and choices.link_dynamics == "model"
    locked = top.section("locked", {}).build(_locked)
    try:
        tree = RigidTree(urdf, joints, gravity, choices.coriolis, masses, locked)
    except RobotError as err:
        if str(err).startswith("locked"):
            raise RobotError(f"{path.name}: {err}") from err
        raise
    constants = top.section("constants", {}).build(_constants)
    poses = top.section("poses").build(lambda s: pose_setup(s, joints)) if "poses" in top else None
    shaken = top.section("frequency").build(lambda s: frequency_setup(s, joints)) if "frequency" in top else None
    command = top.section("command").build(lambda s: _command(s, joints)) if motion else NO_COMMAND
    sensors = {name: s.build(sensor(name, joints)) for name, s in top.section("sensors", *_none(motion)).sections()}
    parameters = {name: s.build(_parameter(name)) for name, s in top.section("parameters", *_none(motion)).sections()}
    controller = top.section("controller").build(lambda s: _controller(s, joints)) if "controller" in top else None
    matrix = (
        top.section("transmission").build(lambda s: transmission_matrix(s, joints)) if "transmission" in top else None
    )
    noise = noise_of(top, joints, motion and choices.link_dynamics != "free")
    robot = Robot(
        name=top.text("name"),
        description=top.text("description", ""),
        tree=tree,
        joints=joints,
        choices=choices,
        constants=constants,
        command=command,
        sensors=sensors,
        parameters=parameters,
        noise=ProcessNoise(False, "integrated", np.zeros(0), np.zeros(0)),
        path=path,
        document=document,
        controller=controller,
        transmission=matrix,
        motion=motion,
        frequency=shaken,
    )
    robot = with_trackers(robot)
    if poses is not None:
        robot = with_poses(robot, poses)
    robot = with_effects(replace(robot, held_at_mean=_held_at_mean(top, locked)), top.texts("effects", ()))
    robot = replace(robot, derived=top.section("derived", {}).build(lambda s: derived_results(s, robot)))
    if motion:
        robot = replace(robot, noise=noise.build(lambda s: process_noise(s, robot)))
    top.raw("calibration")
    check_locked_springs(top, robot)
    check_robot(robot) if motion else check_still_parameters(robot, parameters)
    return robot


def _none(needed: bool) -> list[dict[str, Any]]:
    """What stands in for a section that is not there, where the robot can do without it."""
    return [] if needed else [{}]


def _command(section: Section, joints: tuple[str, ...]) -> Topic:
    held = section.flag("held", True) if "held" in section else None
    confirmed = section.flag("confirmed", False)
    return replace(topic(section, joints, COMMAND_UNITS, scaled=True), held=held, confirmed=confirmed)


def with_effects(robot: Robot, labels: Sequence[str]) -> Robot:
    """The robot with effects ID@OWNER; its parameters must be there already, its noise is as it was.

    Raises:
        EffectError: unknown effect or owner, or one that is there twice.
    """
    found: list[EffectAt] = []
    for label in labels:
        effect, owner = parse_effect(label, robot)
        if any(here.label == label for here in found):
            raise EffectError(f"effect {label} is there twice; remove one")
        found.append(EffectAt(effect, owner))
    parameters = dict(robot.parameters)
    for here in found:
        for p in here.effect.parameters_at(robot, here.owner):
            name = here.parameter(p.name)
            if name in parameters:
                null = None if p.is_shape else p.null
                parameters[name] = replace(parameters[name], effect=here.effect.id, null=null)
    return replace(robot, effects=tuple(found), parameters=parameters)


def urdf_reference(urdf: Path, folder: Path) -> str:
    """How a robot file in `folder` names a URDF: "ready:..." for those of the package, else a relative path."""
    urdf = urdf.resolve()
    if urdf.is_relative_to(READY_ROOT.resolve()):
        return READY_PREFIX + urdf.relative_to(READY_ROOT.resolve()).as_posix()
    return Path(os.path.relpath(urdf, folder.resolve())).as_posix()


def _find(name_or_path: str) -> Path:
    ready = ready_robots()
    if name_or_path in ready:
        return ready[name_or_path]
    path = Path(name_or_path)
    if not path.is_file():
        hint = did_you_mean(name_or_path, list(ready))
        raise RobotError(f"no robot {name_or_path!r}: neither a file nor a ready robot{hint}")
    return path


def _urdf_path(reference: str, robot_file: Path) -> Path:
    if reference.startswith(READY_PREFIX):
        return READY_ROOT / reference.removeprefix(READY_PREFIX)
    return robot_file.parent / reference


def _model_choices(section: Section, joints: tuple[str, ...]) -> ModelChoices:
    return ModelChoices(
        integrator=section.text("integrator", "simpson", INTEGRATORS),
        coriolis=section.flag("coriolis", True),
        friction_velocity=section.text("friction_velocity", "motor", ("motor", "link")),
        friction_sharpness=section.number("friction_sharpness", 200.0, positive=True),
        bias_at_rest=section.flag("bias_at_rest", False),
        rigid_joints=_rigid_joints(section, joints),
        link_dynamics=section.text("link_dynamics", "model", ("model", "free")),
    )


def _rigid_joints(section: Section, joints: tuple[str, ...]) -> tuple[str, ...]:
    rigid = section.texts("rigid_joints", ())
    unknown = [joint for joint in rigid if joint not in joints]
    if unknown:
        raise RobotError(f"{section.place}.rigid_joints: no joint {unknown[0]!r}{did_you_mean(unknown[0], joints)}")
    return rigid


def _held_at_mean(top: Section, locked: dict[str, float]) -> tuple[str, ...]:
    """Joints that the user wants to be held although they move."""
    joints = top.texts("held_at_mean", ())
    unknown = [joint for joint in joints if joint not in locked]
    if unknown:
        raise RobotError(
            f"{top.place}: held_at_mean: {unknown[0]!r} is not in `locked`{did_you_mean(unknown[0], [*locked])}"
        )
    return joints


def _locked(section: Section) -> dict[str, float]:
    return {joint: section.number(joint) for joint in section.keys()}


def _controller(section: Section, joints: tuple[str, ...]) -> PositionController:
    return position_controller(section, topic(section, joints), joints)


def _constants(section: Section) -> dict[str, float]:
    values = {key: section.number(key, None, positive=True) for key in CONSTANTS}
    return {key: value for key, value in values.items() if value is not None}


def _parameter(name: str) -> Any:
    def make(section: Section) -> Parameter:
        fixed = section.flag("fixed", False)
        positive = section.flag("positive", True)
        value = section.number("value", positive=positive)
        return Parameter(
            name=name,
            value=value,
            unit=section.text("unit"),
            prior=section.number("prior", value, positive=positive),
            prior_sigma=section.number("prior_sigma", abs(value) or 1.0, positive=True),
            positive=positive,
            fixed=fixed,
            sigma=section.number("sigma", None, positive=True),
            published=section.number("published", None),
            null=section.number("null", None),
        )

    return make
