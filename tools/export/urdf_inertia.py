# SPDX-License-Identifier: BSD-3-Clause
"""The element <inertial> of a link, read and written, and whether a body can have what it says."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array = NDArray[np.float64]
ROUNDING = 1e-6  # relative; what digits of a file may leave of a moment of inertia that is exactly zero


def inertia_of(link: ET.Element) -> pin.Inertia:
    """Mass, centre of mass and inertia of a link in its own frame; zero where the file has none."""
    inertial = link.find("inertial")
    if inertial is None:
        return pin.Inertia.Zero()
    origin, mass, moments = (inertial.find(tag) for tag in ("origin", "mass", "inertia"))
    place = {} if origin is None else origin.attrib
    com, rpy = (np.array([float(x) for x in place.get(key, "0 0 0").split()]) for key in ("xyz", "rpy"))
    R = pin.rpy.rpyToMatrix(*rpy)
    entry = {} if moments is None else moments.attrib
    xx, yy, zz, xy, xz, yz = (float(entry.get(f"i{axes}", 0.0)) for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))
    own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return pin.Inertia(0.0 if mass is None else float(mass.get("value", 0.0)), com, R @ own @ R.T)


def write_inertial(link: ET.Element, mass: float, com: Array, inertia: Array) -> None:
    """Replaces the <inertial> of a link.

    Args:
        link: the element.
        mass: [kg].
        com: centre of mass in the link's frame, shape (3,) [m].
        inertia: about the centre of mass, along the link's axes, shape (3, 3) [kg m2].
    """
    inertial = link.find("inertial")
    if inertial is None:
        inertial = ET.SubElement(link, "inertial")
    for child in list(inertial):
        inertial.remove(child)
    ET.SubElement(inertial, "origin", xyz=" ".join(f"{x:.9g}" for x in com), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=f"{mass:.9g}")
    places = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    ET.SubElement(inertial, "inertia", {name: f"{inertia[place]:.9g}" for name, place in places.items()})


def is_possible(inertia: pin.Inertia) -> bool:
    """Whether a body can have it: no negative mass or moment, and no principal moment above the sum of the others."""
    moments = np.linalg.eigvalsh(inertia.inertia)
    slack = ROUNDING * float(np.abs(moments).max())
    return bool(inertia.mass >= 0.0 and moments[0] >= -slack and moments[0] + moments[1] >= moments[2] - slack)
