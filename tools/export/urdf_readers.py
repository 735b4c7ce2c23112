# SPDX-License-Identifier: BSD-3-Clause
"""Whether other programs can read a URDF that would be written: pinocchio must, and what stops others is said."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path

import pinocchio as pin

from jointscope.robots.errors import RobotError
from jointscope.robots.urdf.urdf_parser import heard
from jointscope.robots.urdf.urdf_tree import read_urdf
from jointscope.tools.export.urdf_inertia import inertia_of, is_possible

PACKAGE = "package://"
NAMED = 5  # links in a sentence


def stumbling_blocks(root: ET.Element, text: str, maker: Path) -> tuple[str, ...]:
    """What programs may stumble over, a sentence each.

    Args:
        root: of the URDF that would be written.
        text: the same as text.
        maker: the URDF that it was made from.

    Raises:
        RobotError: pinocchio refuses the text although it takes the maker's file.
    """
    old, new = _impossible(read_urdf(maker)), _impossible(root)
    kept, changed = [link for link in new if link in old], [link for link in new if link not in old]
    return tuple(filter(None, (_refused(text, maker), _packages(root), _kept(kept), _changed(changed))))


def _refused(text: str, maker: Path) -> str:
    """That pinocchio refuses the file as it refuses the maker's, from which a robot can still be read here."""
    reason = _why_refused(text)
    if not reason:
        return ""
    if not _why_refused(maker.read_text(encoding="utf-8", errors="replace")):
        raise RobotError(
            f"{maker}: pinocchio refuses the URDF that would be made from it ({reason}); nothing is written"
        )
    return f"pinocchio refuses the file, as it refuses the original: {reason}"


def _why_refused(text: str) -> str:
    """Why pinocchio refuses a URDF; empty where it does not."""
    said = list[str]()
    try:
        with heard(said):
            pin.buildModelFromXML(text)
    except ValueError as err:
        return (said[0] if said else str(err).splitlines()[0]).rstrip(".")
    return ""


def _packages(root: ET.Element) -> str:
    files = {element.get("filename", "") for element in root.iter() if element.get("filename", "").startswith(PACKAGE)}
    if not files:
        return ""
    packages = sorted({file.removeprefix(PACKAGE).partition("/")[0] for file in files})
    return (
        f"{len(files)} file{'s' * (len(files) > 1)} (meshes, textures) of the package{'s' * (len(packages) > 1)} "
        f"{_listed(packages)} {'are' if len(files) > 1 else 'is'} named as package://..., as in the original: "
        "programs outside ROS, such as MuJoCo, need real paths, or a file without <visual> and <collision>"
    )


def _impossible(root: ET.Element) -> list[str]:
    return [link.get("name", "") for link in root.findall("link") if not is_possible(inertia_of(link))]


def _kept(links: list[str]) -> str:
    if not links:
        return ""
    return (
        f"no body can have the inertia of {_listed(links)} (a negative principal moment, or one above the sum of the "
        "others); it is kept as the original has it, and MuJoCo refuses it: correct it in the original"
    )


def _changed(links: list[str]) -> str:
    if not links:
        return ""
    return (
        f"no body can have the inertia that was calibrated for {_listed(links)} (a negative principal moment, or one "
        "above the sum of the others), and MuJoCo refuses it: see the sigmas of its parameters"
    )


def _listed(names: Iterable[str]) -> str:
    every = list(names)
    more = f" and {len(every) - NAMED} more" if len(every) > NAMED else ""
    return ", ".join(every[:NAMED]) + more
