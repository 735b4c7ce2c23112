# SPDX-License-Identifier: BSD-3-Clause
"""A URDF as the simulation of arms reads it: the plain XML, no robotics library.

Only what moves and what has mass is read. Joints inside other elements (transmissions, plugins) are none of the tree.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TURNING = ("revolute", "continuous")
MOVING = (*TURNING, "prismatic")


@dataclass(frozen=True)
class Link:
    """Mass of a link.

    Attributes:
        mass: [kg].
        com: centre of mass in the frame of the link, shape (3,) [m].
        inertia: about the centre of mass, axes of the link, shape (3, 3) [kg m2].
    """

    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True)
class Mimic:
    """A joint that follows another: q = factor * q_of + offset."""

    of: str
    factor: float
    offset: float


@dataclass(frozen=True)
class UrdfJoint:
    """A joint as written.

    Attributes:
        name, kind, parent, child: names and the URDF's type.
        T_parent_joint: frame of the joint in the frame of the parent link, shape (4, 4).
        axis: unit vector in the frame of the joint, shape (3,).
        lower, upper: range [rad or m]; infinite where there is none.
        speed: limit of the velocity [rad/s or m/s]; infinite where there is none.
        mimic: the joint it follows, or None.
    """

    name: str
    kind: str
    parent: str
    child: str
    T_parent_joint: Array
    axis: Array
    lower: float
    upper: float
    speed: float
    mimic: Mimic | None

    @property
    def moves(self) -> bool:
        """Whether it turns or slides."""
        return self.kind in MOVING


@dataclass(frozen=True)
class Urdf:
    """Links by name and joints by name, in the order of the file."""

    links: dict[str, Link]
    joints: dict[str, UrdfJoint]

    @property
    def root(self) -> str:
        """The link that is nobody's child."""
        children = {joint.child for joint in self.joints.values()}
        return next(name for name in self.links if name not in children)

    def above(self, link: str) -> list[UrdfJoint]:
        """Joints between the root and a link, the root's first."""
        by_child = {joint.child: joint for joint in self.joints.values()}
        found: list[UrdfJoint] = []
        while link in by_child:
            found.append(by_child[link])
            link = by_child[link].parent
        return found[::-1]

    def driver(self, name: str) -> Mimic:
        """The joint that is not a mimic which a joint follows in the end; itself where it is none."""
        factor, offset = 1.0, 0.0
        while (mimic := self.joints[name].mimic) is not None:
            name, factor, offset = mimic.of, factor * mimic.factor, factor * mimic.offset + offset
        return Mimic(name, factor, offset)


def read_urdf(path: Path) -> Urdf:
    """Reads a file."""
    # prefixes that nobody declares stand in files of makers, and readers of URDFs do not mind
    text = re.sub(r"(</?|\s)(\w+):(?=\w+[\s=>/])", r"\1\2_", path.read_text(encoding="utf-8"))
    robot = ET.fromstring(text.encode())
    links = {str(link.get("name")): _link(link) for link in robot.findall("link")}
    joints = {joint.name: joint for joint in map(_joint, robot.findall("joint"))}
    # some files name a joint that is not there; nothing can follow it
    lost = {name for name, joint in joints.items() if joint.mimic and joint.mimic.of not in joints}
    return Urdf(links, {name: replace(joint, mimic=None) if name in lost else joint for name, joint in joints.items()})


def rotation(rpy: Array) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll), shape (3, 3)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def _link(element: ET.Element) -> Link:
    inertial = element.find("inertial")
    mass = inertial.find("mass") if inertial is not None else None
    if inertial is None or mass is None:
        return Link(0.0, np.zeros(3), np.zeros((3, 3)))
    T_link_com = _origin(inertial)
    tensor = inertial.find("inertia")
    i = {key: float(tensor.get(key, 0.0)) if tensor is not None else 0.0 for key in _TENSOR}
    own = np.array([[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]])
    R = T_link_com[:3, :3]
    return Link(float(mass.get("value", 0.0)), T_link_com[:3, 3], R @ own @ R.T)


_TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def _joint(element: ET.Element) -> UrdfJoint:
    kind = str(element.get("type"))
    limit, follows = element.find("limit"), element.find("mimic")
    limits = dict(limit.attrib) if limit is not None else {}
    bounded = kind in ("revolute", "prismatic") and "lower" in limits and "upper" in limits
    axis = element.find("axis")
    direction = _numbers(axis.get("xyz", "1 0 0")) if axis is not None else np.array([1.0, 0.0, 0.0])
    mimic = None
    if follows is not None and kind in MOVING:
        factor, offset = float(follows.get("multiplier", 1.0)), float(follows.get("offset", 0.0))
        mimic = Mimic(str(follows.get("joint")), factor, offset)
    return UrdfJoint(
        name=str(element.get("name")),
        kind=kind,
        parent=str(element.find("parent").get("link")),  # type: ignore[union-attr]
        child=str(element.find("child").get("link")),  # type: ignore[union-attr]
        T_parent_joint=_origin(element),
        axis=direction / max(float(np.linalg.norm(direction)), 1e-12),
        lower=float(limits["lower"]) if bounded else -np.inf,
        upper=float(limits["upper"]) if bounded else np.inf,
        speed=float(limits.get("velocity", 0.0)) or np.inf,
        mimic=mimic,
    )


def _origin(element: ET.Element) -> Array:
    T = np.eye(4)
    origin = element.find("origin")
    if origin is not None:
        T[:3, :3] = rotation(_numbers(origin.get("rpy", "0 0 0")))
        T[:3, 3] = _numbers(origin.get("xyz", "0 0 0"))
    return T


def _numbers(text: str) -> Array:
    return np.array([float(part) for part in text.split()])
