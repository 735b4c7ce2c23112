# SPDX-License-Identifier: BSD-3-Clause
"""pinocchio's URDF parser, with what it says on stderr kept for the user's eyes."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pinocchio as pin

from jointscope.robots.errors import RobotError
from jointscope.robots.outside_modules import need_module
from jointscope.robots.urdf.urdf_text import UrdfText


def parse_urdf(path: Path, text: UrdfText) -> tuple[pin.Model, tuple[str, ...]]:
    """Reads a URDF.

    Args:
        path: the file.
        text: what is in it.

    Returns:
        The model, and what the parser complained about without giving up.

    Raises:
        RobotError: it is no URDF.
    """
    need_module("pinocchio")
    completed, said = text.completed, list[str]()
    try:
        with heard(said):
            model = pin.buildModelFromUrdf(str(path)) if completed is None else pin.buildModelFromXML(completed)
    except Exception as err:
        reason = text.trouble or (said[0] if said else str(err).splitlines()[0])
        raise RobotError(f"{path} is not a URDF that pinocchio can read: {reason}") from err
    return model, tuple(said)


@contextlib.contextmanager
def heard(said: list[str]) -> Iterator[None]:
    """Keeps the parser's own lines, written from C++, off the screen, and collects those that name a mistake."""
    try:
        saved = os.dup(2)
    except OSError:
        yield  # there is no stderr to keep quiet
        return
    with tempfile.TemporaryFile() as kept:
        os.dup2(kept.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            kept.seek(0)
            lines = kept.read().decode(errors="replace").splitlines()
            said += [" ".join(line.removeprefix("Error:").split()) for line in lines if line.startswith("Error:")]
