# SPDX-License-Identifier: BSD-3-Clause
"""A TX90L whose tool carries more than one target, measured by a simulated tracker."""

from __future__ import annotations

from pathlib import Path

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot

THREE = "left: {at: [0.08, 0.0, 0.03]}, right: {}"


def tool_with(folder: Path, targets: str = THREE, more: str = "") -> Robot:
    """The ready robot with further targets, and further lines in its section `poses`."""
    ready = load_robot("tx90l").path
    text = ready.read_text().replace("urdf: tx90l.urdf", f"urdf: {ready.parent / 'tx90l.urdf'}")
    lines = f"  targets: {{{targets}}}\n" if targets else ""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "tool.yaml"
    path.write_text(text.replace("  sigma: 1.0e-5", f"{lines}{more}  sigma: 1.0e-5", 1))
    return load_robot(path)
