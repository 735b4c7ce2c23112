# SPDX-License-Identifier: BSD-3-Clause
"""The robot's own URDF with what was calibrated: inertias, geometry, friction, and springs as joints of their own.

Everything else of the file stays, comments and meshes, too. An elastic joint becomes two in a row: JOINT turns with the
motor, and JOINT_spring behind it is what the spring lets the link turn beyond. Its stiffness stands in an element
<gazebo>, which other programs pass over; a URDF has no place for it.
"""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect
from jointscope.robots.errors import RobotError
from jointscope.robots.geometry.calibrated_urdf import move_joints
from jointscope.robots.geometry.error_parameters import error_names, pose_units
from jointscope.robots.model.robot import Robot
from jointscope.robots.model.structured_tree import inertia_changes
from jointscope.robots.urdf.urdf_tree import read_urdf, urdf_text
from jointscope.tools.export.bodies_as_calibrated import bodies_as_calibrated
from jointscope.tools.export.exported import Exported, need_masses, of_drives, why_not, without_noise_below_zero
from jointscope.tools.export.urdf_inertia import inertia_of, write_inertial
from jointscope.tools.export.urdf_readers import stumbling_blocks

Array = NDArray[np.float64]
NO_PLACE = "a URDF has no place for it"
LIGHT = 1e-3  # [kg] of a rotor, which programs need; its inertia counts
VISCOUS = ("motor_viscous", "link_viscous")  # effects that are damping where motor and link are one
DRY = "link_coulomb"


def urdf_model(robot: Robot) -> Exported:
    """The robot as URDF.

    Args:
        robot: as calibrated, of motion, of poses or of both.

    Raises:
        RobotError: its URDF cannot be read or lacks a joint, masses are not known, or pinocchio refuses the new file.
    """
    root = read_urdf(robot.tree.urdf)
    if robot.poses is not None:
        move_joints(root, robot)
    if not robot.motion:
        return _exported(root, robot, ("geometry",), {**_sag(robot), **_effects(robot, set())})
    need_masses(robot)
    joints = {element.get("name", ""): element for element in root.findall("joint")}
    links = {element.get("name", ""): element for element in root.findall("link")}
    _change_bodies(robot, joints, links)
    settled, zeroed = without_noise_below_zero(*_frictions(bodies_as_calibrated(robot)))
    soft = [joint for joint in settled.joints if joint in settled.layout.motors]
    held = set()
    for joint in settled.joints:
        if joint not in joints:
            raise RobotError(f"{robot.tree.urdf}: there is no <joint name={joint!r}>")
        held |= _damp(joints[joint], settled, joint, joint in soft)
        if joint in soft:
            _split(root, joints[joint], settled, joint)
    gone = _effects(settled, held)
    springs = (f"springs of {', '.join(soft)} (joints JOINT_spring)",) if soft else ()
    named = [here.label for here in robot.effects if here.label not in gone]
    geometry = ("geometry",) if robot.poses is not None else ()
    holds = ("inertias", *geometry, "dry friction", *springs, *named)
    exported = _exported(root, robot, holds, {**_sag(robot), **_drives(settled, soft), **gone})
    return replace(exported, warnings=(*zeroed, *exported.warnings))


def _exported(root: ET.Element, robot: Robot, holds: tuple[str, ...], lacks: dict[str, str]) -> Exported:
    text = urdf_text(root)
    return Exported(text, holds, lacks, stumbling_blocks(root, text, robot.tree.urdf))


def _frictions(robot: Robot) -> tuple[Robot, list[str]]:
    """A robot, and full names of what is damping or dry friction in a URDF."""
    own = [(here, "torque" if here.effect.id == DRY else "coefficient") for here in robot.effects]
    return robot, [here.parameter(name) for here, name in own if here.effect.id in (*VISCOUS, DRY)]


def _effects(robot: Robot, held: set[str]) -> dict[str, str]:
    """Effects that are not in the file, by label, and why."""
    return {here.label: why_not(here.effect, NO_PLACE) for here in robot.effects if here.label not in held}


def _sag(robot: Robot) -> dict[str, str]:
    """What poses have found beside the geometry."""
    if robot.poses is None:
        return {}
    geometry = error_names(robot.joints, robot.poses.other_names)
    found = [name for name in pose_units(robot.joints) if name in robot.parameters and name not in geometry]
    return {", ".join(found): f"{NO_PLACE}; it depends on load and position"} if found else {}


def _change_bodies(robot: Robot, joints: Mapping[str, ET.Element], links: Mapping[str, ET.Element]) -> None:
    """Adds to the inertias of links what effects found."""
    changing = [(here.effect, here.owner) for here in robot.effects]
    owners = {e.joint_of(robot, owner) for e, owner in changing if isinstance(e, InertiaEffect)}
    model = robot.tree.model
    for change in inertia_changes(robot, model):
        name = model.names[change.joint]
        child = joints[name].find("child") if name in joints else None
        if name in owners and child is not None:
            _add_inertia(links[child.get("link", "")], robot.parameter(change.name).value * change.direction)


def _add_inertia(link: ET.Element, change: Array) -> None:
    """Changes the ten dynamic parameters of a link about its origin, in pinocchio's order, shape (10,)."""
    parameters = inertia_of(link).toDynamicParameters() + change
    mass, first = parameters[0], parameters[1:4]
    com = first / mass if mass > 0.0 else np.zeros(3)
    xx, xy, yy, xz, yz, zz = parameters[4:]
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    write_inertial(link, mass, com, about_origin - mass * (com @ com * np.eye(3) - np.outer(com, com)))


def _damp(element: ET.Element, robot: Robot, joint: str, soft: bool) -> set[str]:
    """Writes <dynamics> of a joint; returns the labels of the effects that are in it."""
    viscous, dry, held = 0.0, robot.parameter(f"{joint}.coulomb_torque").value, set()
    for here in robot.effects:
        rigid_or_motor = not soft or here.effect.id == "motor_viscous"
        if here.owner != joint or not rigid_or_motor or here.effect.id not in (*VISCOUS, DRY):
            continue
        held.add(here.label)
        if here.effect.id == DRY:
            dry += robot.parameter(here.parameter("torque")).value
        else:
            viscous += robot.parameter(here.parameter("coefficient")).value
    _set_dynamics(element, viscous, dry)
    return held


def _set_dynamics(element: ET.Element, damping: float, friction: float) -> None:
    dynamics = element.find("dynamics")
    if dynamics is None:
        dynamics = ET.SubElement(element, "dynamics")
    dynamics.set("damping", f"{damping:.9g}")
    dynamics.set("friction", f"{friction:.9g}")


def _split(root: ET.Element, element: ET.Element, robot: Robot, joint: str) -> None:
    """Makes two joints of an elastic one: that of its motor, which keeps name and place, and behind it the spring."""
    child = element.find("child")
    assert child is not None
    spring = ET.Element("joint", name=f"{joint}_spring", type=_unlimited(element))
    ET.SubElement(spring, "parent", link=f"{joint}_rotor")
    ET.SubElement(spring, "child", link=child.get("link", ""))
    axis = element.find("axis")
    if axis is not None:
        spring.append(copy.deepcopy(axis))
    if spring.get("type") == "prismatic":
        ET.SubElement(spring, "limit", lower="-1", upper="1", effort="1e9", velocity="1e3")
    _set_dynamics(spring, robot.parameter(f"{joint}.damping").value, 0.0)
    child.set("link", f"{joint}_rotor")
    rotor = ET.Element("link", name=f"{joint}_rotor")
    write_inertial(rotor, LIGHT, np.zeros(3), _disc(axis, robot.drive_parameter(joint, "inertia").value))
    gazebo = ET.Element("gazebo", reference=f"{joint}_spring")
    ET.SubElement(gazebo, "springStiffness").text = f"{robot.parameter(f'{joint}.stiffness').value:.9g}"
    ET.SubElement(gazebo, "springReference").text = "0"
    place = list(root).index(element) + 1
    root[place:place] = [rotor, spring, gazebo]


def _disc(axis: ET.Element | None, inertia: float) -> Array:
    """Inertia of a thin disc about an axis, shape (3, 3) [kg m2]: no body has less across it."""
    a = np.array([float(x) for x in ("1 0 0" if axis is None else axis.get("xyz", "1 0 0")).split()])
    a /= np.linalg.norm(a)
    return 0.5 * inertia * (np.eye(3) + np.outer(a, a))


def _unlimited(element: ET.Element) -> str:
    return "prismatic" if element.get("type") == "prismatic" else "continuous"


def _drives(robot: Robot, soft: list[str]) -> dict[str, str]:
    """What a URDF lacks of the base model."""
    found = {}
    if soft:
        found["stiffness"] = f"{NO_PLACE}, so only Gazebo reads it (<springStiffness>)"
        found["inertia of elastic drives"] = (
            "turns as a body between two links here, so joints before it feel it too; where your program has an "
            f"armature, set that instead: {of_drives(robot, 'inertia')}"
        )
    if len(soft) < robot.n:
        found["rotor inertias"] = f"{NO_PLACE}; set the armature: {of_drives(robot, 'inertia')}"
    for law in robot.drive_laws:
        found[law] = f"{NO_PLACE}; your controller needs it: {of_drives(robot, law)}"
    return found
