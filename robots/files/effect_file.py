# SPDX-License-Identifier: BSD-3-Clause
"""A user's own Python file with physical effects: runs it and finds what it holds, or says what is wrong and where."""

from __future__ import annotations

import ast
import hashlib
import sys
import traceback
from pathlib import Path
from types import ModuleType

from jointscope.robots.effect_kinds.effect import Effect
from jointscope.robots.errors import EffectError


def effects_of_file(path: Path) -> list[tuple[Effect, str]]:
    """Runs a Python file.

    Args:
        path: the file, as the user named it.

    Returns:
        Each effect at its top level with its place ("my_effects.py, line 12"), in the order of the file.

    Raises:
        EffectError: the file cannot be read, is not Python, or fails when it runs.
    """
    source, tree = _parsed(path)
    # named after what it says: a worker on another machine, which has the file elsewhere, knows it by the same name
    module = ModuleType(f"jointscope_user_effects_{hashlib.sha256(source.encode()).hexdigest()[:12]}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # dataclasses look their module up by name
    try:
        exec(compile(source, str(path), "exec"), module.__dict__)
    except (Exception, SystemExit) as err:
        raise EffectError(_failure(path, err)) from err
    lines = _lines_of_names(tree)
    found: dict[int, tuple[Effect, str]] = {}
    for name, member in vars(module).items():
        if isinstance(member, Effect):
            found.setdefault(id(member), (member, f"{path}, line {lines.get(name, 1)}"))
    return list(found.values())


def _parsed(path: Path) -> tuple[str, ast.Module]:
    """The file's text and syntax tree."""
    try:
        source = path.read_text(encoding="utf-8")
    except OSError as err:
        raise EffectError(f"cannot read the effects file {path}: {err.strerror or err}") from err
    except UnicodeDecodeError as err:
        raise EffectError(f"{path} is not a Python file: it is not text; --effects takes a .py file") from err
    try:
        return source, ast.parse(source)
    except SyntaxError as err:
        raise EffectError(f"{path}, line {err.lineno or 1}: not Python: {err.msg}; correct the file") from err
    except ValueError as err:  # null bytes
        raise EffectError(f"{path} is not a Python file: {err}; --effects takes a .py file") from err


def _failure(path: Path, err: BaseException) -> str:
    """What went wrong, at the last line of the user's own file that was running."""
    lines = [frame.lineno for frame in traceback.extract_tb(err.__traceback__) if frame.filename == str(path)]
    text = " ".join(str(err).split())
    return f"{path}, line {lines[-1] if lines else 1}: {type(err).__name__}: {text}; correct the file"


def _lines_of_names(tree: ast.Module) -> dict[str, int]:
    """The line at which each name of the top level was made."""
    lines: dict[str, int] = {}
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        for target in targets:
            if isinstance(target, ast.Name):
                lines[target.id] = node.lineno
    return lines
