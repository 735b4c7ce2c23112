# SPDX-License-Identifier: BSD-3-Clause
"""YAML files with their comments: read, with a line for the user where that fails, and written again."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML, YAMLError

from jointscope.robots.errors import RobotError

ROBOT_FILE = "robot file"
_WAYS = {ROBOT_FILE: "; a robot comes first, then the bag"}


def read_document(path: Path, what: str = ROBOT_FILE) -> Any:
    """The content of a YAML file with its comments.

    Args:
        path: the file.
        what: it should be, for the messages.

    Raises:
        RobotError: the file cannot be read or is not YAML.
    """
    try:
        document = _yaml().load(path.read_text(encoding="utf-8"))
    except OSError as err:
        raise RobotError(f"cannot read the {what} {path}: {err.strerror or err}") from err
    except UnicodeDecodeError as err:
        raise RobotError(f"{path} is not a {what}: it is not text{_WAYS.get(what, '')}") from err
    except YAMLError as err:
        if path.suffix == ".urdf" or "<robot" in path.read_text(encoding="utf-8")[:2000]:
            way = f"; make one with: jointscope init {path} BAG -o {path.stem}_robot.yaml" if what == ROBOT_FILE else ""
            raise RobotError(f"{path.name} is a URDF and no {what}{way}") from err
        raise RobotError(f"{path.name} is not YAML: {_trouble(err)}") from err
    return document


def dump_document(document: Any) -> str:
    """A YAML document as text, comments included."""
    stream = io.StringIO()
    _yaml().dump(document, stream)
    return stream.getvalue()


def _trouble(err: YAMLError) -> str:
    """The parser's complaint in one line, with the place in the file."""
    mark, problem = getattr(err, "problem_mark", None), getattr(err, "problem", None)
    text = " ".join(str(problem or err).split())[:160]
    return f"line {mark.line + 1}, column {mark.column + 1}: {text}" if mark is not None else text


def _yaml() -> YAML:
    yaml = YAML()
    yaml.width = 160
    yaml.preserve_quotes = True
    return yaml
