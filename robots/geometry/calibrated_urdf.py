# SPDX-License-Identifier: BSD-3-Clause
"""The URDF of an arm with its geometric errors in the origins of its joints.

Everything that is fixed before a joint turns fits into its <origin>: lengths, tilts of the axis, zero of the encoder.
Sag and backlash depend on the load; a comment says that they are not in it.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.misplaced_joints import LENGTHS, across, turned
from jointscope.robots.errors import RobotError
from jointscope.robots.geometry.error_parameters import TOOL, TRACKER
from jointscope.robots.model.robot import Robot
from jointscope.robots.urdf.motion_axis import motion_axis
from jointscope.robots.urdf.urdf_tree import read_urdf, urdf_text

Array = NDArray[np.float64]
NOTE = " geometric errors found by jointscope; sag of drives and bearings and backlash are not in this file "


def calibrated_urdf(robot: Robot) -> str:
    """The text of the URDF with the errors of a robot that has a section `poses`.

    Raises:
        RobotError: the file cannot be read, or a joint has no element of its own.
    """
    root = read_urdf(robot.tree.urdf)
    move_joints(root, robot)
    root.insert(0, ET.Comment(NOTE))
    return urdf_text(root)


def move_joints(root: ET.Element, robot: Robot) -> None:
    """Puts the errors of a robot that has a section `poses` into the joints of its URDF."""
    assert robot.poses is not None
    errors = robot.values
    joints = {element.get("name"): element for element in root.findall("joint")}
    model = robot.tree.model
    for j in range(1, model.njoints):
        name = model.names[j]
        along, x, y = across(motion_axis(model.joints[j])[3:])
        turn = np.eye(3)
        for part, axis in (("mis_y", y), ("mis_x", x), ("offset", along)):
            turn = turn @ turned(axis, np.array(errors.get(f"{name}.{part}", 0.0)))
        _move(joints.get(name), name, _lengths(errors, name), turn)
    parent = {child.get("link"): joint for joint in joints.values() for child in joint.findall("child")}
    owners = [(TOOL, robot.poses.link, 1.0), (TRACKER, robot.poses.tracker_link, -1.0)]
    links = [target.link for target in robot.poses.targets]
    owners += [(target.name, target.link, 1.0) for target in robot.poses.others if links.count(target.link) == 1]
    for owner, link, sign in owners:
        mount = parent.get(link) if link is not None else None
        if mount is not None and mount.get("type") == "fixed":
            _move_behind(mount, sign * _lengths(errors, owner))


def _lengths(errors: Mapping[str, float], owner: str) -> Array:
    return np.array([errors.get(f"{owner}.{part}", 0.0) for part in LENGTHS])


def _move(joint: ET.Element | None, name: str, shift: Array, turn: Array) -> None:
    """Shifts a joint in the axes of the link before it, and turns it in its own."""
    if joint is None:
        raise RobotError(f"the URDF has no <joint name={name!r}>")
    xyz, R = _origin(joint)
    _write(joint, xyz + shift, R @ turn)


def _move_behind(joint: ET.Element, shift: Array) -> None:
    """Shifts what a fixed joint carries in its own axes."""
    xyz, R = _origin(joint)
    _write(joint, xyz + R @ shift, R)


def _origin(joint: ET.Element) -> tuple[Array, Array]:
    origin = joint.find("origin")
    xyz, rpy = ("0 0 0", "0 0 0") if origin is None else (origin.get("xyz", "0 0 0"), origin.get("rpy", "0 0 0"))
    turn = np.array(pin.rpy.rpyToMatrix(*(float(x) for x in rpy.split())))
    return np.array([float(x) for x in xyz.split()]), turn


def _write(joint: ET.Element, xyz: Array, R: Array) -> None:
    origin = joint.find("origin")
    if origin is None:
        origin = ET.SubElement(joint, "origin")
    origin.set("xyz", " ".join(f"{x:.9g}" for x in xyz))
    origin.set("rpy", " ".join(f"{x:.9g}" for x in pin.rpy.matrixToRpy(R)))
