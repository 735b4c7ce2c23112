# SPDX-License-Identifier: BSD-3-Clause
"""A calibrated robot written for other programs: what `jointscope export` and `jointscope.export` do."""

from __future__ import annotations

import textwrap
from contextlib import ExitStack
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from jointscope.robots.errors import RobotError
from jointscope.robots.model.robot import Robot
from jointscope.tools.export.exported import Exported
from jointscope.tools.export.mujoco_model import mujoco_model
from jointscope.tools.export.urdf_model import urdf_model
from jointscope.tools.writing.protected_files import check_robot_files
from jointscope.tools.writing.whole_file import check_outputs, whole_file, write_json

WIDTH = 110
FORMATS = {"urdf": urdf_model, "mjcf": mujoco_model}


@dataclass(frozen=True, repr=False)
class ExportedFiles:
    """What was written, and what the formats cannot hold.

    Attributes:
        robot: its name.
        paths: where each format was written, by "urdf", "mjcf".
        models: what each file holds and lacks, by the same keys.
    """

    robot: str
    paths: dict[str, Path]
    models: dict[str, Exported]

    def answer(self) -> str:
        """What each file holds, what it lacks, and what its readers may stumble over; several lines."""
        return "\n\n".join(_told(self.paths[kind], exported) for kind, exported in self.models.items())

    def to_json(self) -> dict[str, Any]:
        """The same for machines."""
        return {"robot": self.robot, **{kind: exported.to_json() for kind, exported in self.models.items()}}

    def __repr__(self) -> str:
        """What `print` shows."""
        return self.answer()

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        return f"<pre>{escape(self.answer())}</pre>"


def export_files(
    robot: Robot, urdf: Path | None = None, mjcf: Path | None = None, json: Path | None = None
) -> ExportedFiles:
    """Makes the models, loads each as its readers will, and writes all files or none.

    Args:
        robot: as calibrated.
        urdf: file to write.
        mjcf: file to write; at least one of both.
        json: file for what the formats hold and lack.

    Raises:
        RobotError: no file is named, or masses are not known.
        SimulationError: MuJoCo is missing, or cannot build the model.
        JointscopeError: a file cannot be written.
    """
    paths = {kind: path for kind, path in (("urdf", urdf), ("mjcf", mjcf)) if path is not None}
    if not paths:
        raise RobotError(
            "nothing to write; name a file: jointscope export ROBOT --urdf F.urdf --mjcf F.xml "
            "(in Python: export(robot, urdf=..., mjcf=...))"
        )
    check_outputs([urdf, mjcf, json], [robot.path])
    check_robot_files({"urdf": urdf, "mjcf": mjcf, "json": json}, [robot.path])
    done = ExportedFiles(robot.name, paths, {kind: FORMATS[kind](robot) for kind in paths})
    with ExitStack() as stack:
        for kind, path in paths.items():
            stack.enter_context(whole_file(path)).write_text(done.models[kind].text, encoding="utf-8")
        if json is not None:
            write_json(stack.enter_context(whole_file(json)), done.to_json())
    return done


def _told(path: Path, exported: Exported) -> str:
    lines = textwrap.wrap(f"Wrote {path}: {', '.join(exported.holds)}", WIDTH, subsequent_indent="  ")
    if exported.lacks:
        lines.append("Not in it:")
    for name, reason in exported.lacks.items():
        lines += textwrap.wrap(f"{name}: {reason}", WIDTH, initial_indent="  ", subsequent_indent="    ")
    for warning in exported.warnings:
        lines += textwrap.wrap(f"Note: {warning}", WIDTH, subsequent_indent="  ", break_on_hyphens=False)
    return "\n".join(lines)
