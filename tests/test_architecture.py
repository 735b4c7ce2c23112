# SPDX-License-Identifier: BSD-3-Clause
"""One way through the house: robots <- factors <- graphs <- tools, read from the sources."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("robots", "factors", "graphs", "tools")
MODULES = sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py"))
OUTSIDE = {
    "gtsam": {"factors", "graphs"},
    "pinocchio": {"robots", "tools"},
    "rosbags": {"tools"},
    "rerun": {"tools"},
    "mujoco": {"tools"},
    "ruamel": {"robots"},
}
MOST_LINES = 300
MOST_LINES_OF_A_FUNCTION = 60
VAGUE_NAMES = {"utils", "helpers", "base", "common", "misc"}


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def imported(path: Path) -> set[str]:
    """All modules that a file imports, anywhere in it."""
    names: set[str] = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name_of(path)}:{node.lineno}: write jointscope.<room>..., not a relative import"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_imports_go_one_way(path):
    room = path.relative_to(ROOT).parts[0]
    allowed = ROOMS[: ROOMS.index(room) + 1]
    for module in imported(path):
        first, _, rest = module.partition(".")
        if first == "jointscope" and rest.split(".")[0] in ROOMS:
            assert rest.split(".")[0] in allowed, f"{room} must not import {module}"
        assert first not in ROOMS, f"import jointscope.{module}, not {module}"
        assert room in OUTSIDE.get(first, set(ROOMS)), f"{room} must not import {first}"


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_every_module_has_a_licence_line_a_docstring_and_a_name_that_says_something(path):
    assert path.read_text(encoding="utf-8").startswith("# SPDX-License-Identifier: BSD-3-Clause\n")
    assert ast.get_docstring(tree_of(path))
    assert path.stem not in VAGUE_NAMES


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_files_and_functions_stay_short(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MOST_LINES
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.FunctionDef):
            code = node.body[1:] if ast.get_docstring(node) else node.body
            length = node.end_lineno - code[0].lineno + 1 if code else 0
            assert length <= MOST_LINES_OF_A_FUNCTION, f"{node.name} has {length} lines"


def test_tests_carry_the_licence_line_too():
    for path in (ROOT / "tests").rglob("*.py"):
        assert path.read_text(encoding="utf-8").startswith("# SPDX-License-Identifier: BSD-3-Clause\n"), path
