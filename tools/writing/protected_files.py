# SPDX-License-Identifier: BSD-3-Clause
"""Files that a robot is made of, which no result may overwrite: its URDF, and, but for a robot file, the robot file."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from jointscope.robots.errors import JointscopeError

URDF_LINE = re.compile(r"^urdf:\s*['\"]?([^'\"#\n]+?)['\"]?\s*(?:#.*)?$", re.MULTILINE)
RESULTS = ("json", "report", "rrd")  # what is no robot file
OUTPUTS = ("output", "urdf", "mjcf", *RESULTS)


def check_protected(args: argparse.Namespace) -> None:
    """Refuses outputs that would replace a part of a robot that the command reads.

    Args:
        args: of any verb; its robots may be in `robot` or `robots`.

    Raises:
        JointscopeError: an output is the URDF of a robot file, or a result other than a robot is the robot file.
    """
    check_robot_files({option: getattr(args, option, None) for option in OUTPUTS}, _robot_files(args))


def check_robot_files(outputs: Mapping[str, Any], robots: Iterable[Path]) -> None:
    """Refuses outputs that would replace a part of some robots.

    Args:
        outputs: by what they are, one of OUTPUTS; what is no path is not written.
        robots: their files.

    Raises:
        JointscopeError: an output is the URDF of a robot file, or a result other than a robot is the robot file.
    """
    for robot in robots:
        urdf = _urdf_of(robot)
        for option, target in outputs.items():
            if not isinstance(target, Path):
                continue
            if urdf is not None and target.resolve() == urdf.resolve():
                raise JointscopeError(f"cannot write {target}: it is the URDF of {robot}; give it another name")
            if option in RESULTS and target.resolve() == robot.resolve():
                raise JointscopeError(f"cannot write {target}: it is also an input; give it another name")


def _robot_files(args: argparse.Namespace) -> Iterator[Path]:
    """Robot files among the arguments; names of ready robots are none."""
    for value in (getattr(args, "robot", None), *(getattr(args, "robots", None) or ())):
        if isinstance(value, str | Path) and Path(value).is_file():
            yield Path(value)


def _urdf_of(robot: Path) -> Path | None:
    """The URDF that a robot file names, without reading all of it; None where it names none."""
    try:
        found = URDF_LINE.search(robot.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError):
        return None
    return robot.parent / found[1].strip() if found else None
