# SPDX-License-Identifier: BSD-3-Clause
"""One way through the house, read from the sources: robots <- factors <- graphs <- tools, and room by room."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FLOORS = ("robots", "factors", "graphs", "tools")
MODULES = sorted(path for floor in FLOORS for path in (ROOT / floor).rglob("*.py"))
ROOMS = """
robots robots.urdf robots.bodies robots.parts robots.effect_kinds robots.model robots.geometry robots.effects
robots.ready_effects robots.dynamics robots.recordings robots.rests robots.files.sections robots.files
robots.ready
factors
graphs.kernels graphs.problem graphs.solving graphs.workers graphs.spread graphs.gtsam_solvers graphs.noise
graphs.starts graphs.screening graphs.locked_springs graphs.scoring.columns
graphs.scoring graphs.scoring.regression graphs.calibration.stages graphs.calibration
graphs.responses graphs.frequency graphs.rest_sets graphs.rests graphs.rest_search graphs.poses
graphs.joint_kinds
graphs.comparison graphs.refits graphs.judging graphs.discovery graphs.across_kinds graphs.transmission
graphs.fixed_lag.window
graphs.fixed_lag.messages graphs.fixed_lag graphs.fixed_lag.replay
tools.writing tools.bags.clocks tools.bags.tidying tools.bags.messages tools.bags
tools.bags.at_poses tools.bags.descriptions
tools.simulator.world tools.simulator.loop tools.simulator.effects tools.simulator.arm tools.simulator
tools.closed_loop.planning tools.closed_loop.controllers tools.closed_loop.sources tools.closed_loop
tools.export tools.acceptance tools.init.streams tools.init.estimates tools.init tools.init.text
tools.presentation tools.verdicts.priors tools.verdicts.rests tools.verdicts tools.terminal tools.terminal.searches
tools.report.pdf tools.report.page
tools.report.sections.calibration
tools.report.sections.comparison
tools.report.sections.diagnosis tools.report.sections.replay tools.report.sections.closed_loop tools.report
tools.report.searches
tools.rerun_log.entities tools.rerun_log tools.verb_parts tools.verb_parts.simulations tools.verb_parts.searches
tools.notebook tools.verbs tools
""".split()
"""All rooms in the order of their imports: a module imports from its own room and from those before it."""
MOST_FILES = 16
ONE_FILE_EACH = {"factors", "robots.effects", "tools.simulator.effects", "tools.verbs"}  # a residual, an effect, a verb
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


def imported_names(path: Path) -> set[str]:
    """What the names are called that a file takes from other modules of the house."""
    froms = [node for node in ast.walk(tree_of(path)) if isinstance(node, ast.ImportFrom)]
    ours = [node for node in froms if (node.module or "").startswith("jointscope.")]
    return {alias.asname or alias.name for node in ours for alias in node.names}


def room_of(path: Path) -> str:
    """The room that a file stands in."""
    return ".".join(path.relative_to(ROOT).parts[:-1])


def room_of_import(module: str) -> str:
    """The room of `jointscope.<module>`, which may end in the name of something in a module or in a room's __init__."""
    parts = module.split(".")
    return ".".join(parts[: max(n for n in range(1, len(parts) + 1) if (ROOT / Path(*parts[:n])).is_dir())])


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_imports_go_one_way(path):
    floor = path.relative_to(ROOT).parts[0]
    allowed = FLOORS[: FLOORS.index(floor) + 1]
    for module in imported(path):
        first, _, rest = module.partition(".")
        if first == "jointscope" and rest.split(".")[0] in FLOORS:
            assert rest.split(".")[0] in allowed, f"{floor} must not import {module}"
        assert first not in FLOORS, f"import jointscope.{module}, not {module}"
        assert floor in OUTSIDE.get(first, set(FLOORS)), f"{floor} must not import {first}"


@pytest.mark.parametrize("path", [path for path in MODULES if path.name != "__init__.py"], ids=name_of)
def test_rooms_stand_in_one_order_of_imports(path):
    if "facade" in path.parts:
        return
    before = ROOMS[: ROOMS.index(room_of(path)) + 1]
    for module in imported(path):
        first, _, rest = module.partition(".")
        if first == "jointscope" and rest.split(".")[0] in FLOORS:
            assert room_of_import(rest) in before, f"{room_of(path)} stands before {room_of_import(rest)}: {module}"


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_imports_name_the_module_in_which_a_thing_stands(path):
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("jointscope."):
            source = (ROOT / Path(*node.module.split(".")[1:])).with_suffix(".py")
            passed_on = imported_names(source) if source.is_file() else set()
            for alias in node.names:
                assert alias.name not in passed_on, f"{node.module} only passes {alias.name} on: import it from its own"
                assert alias.name != alias.asname, f"{alias.name} is passed on: let others import it from {node.module}"


def test_no_room_is_a_hall():
    for room in ROOMS:
        files = [path for path in (ROOT / room.replace(".", "/")).glob("*.py") if path.name != "__init__.py"]
        assert room in ONE_FILE_EACH or len(files) <= MOST_FILES, f"{room} has {len(files)} files"


def test_every_room_says_what_goes_in_and_what_comes_out():
    for path in (path for path in MODULES if path.name == "__init__.py" and "facade" not in path.parts):
        assert len((ast.get_docstring(tree_of(path)) or "").split()) >= 4, path


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


def test_the_map_has_every_room_and_the_way_of_a_sample_names_files_that_are_there():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    plan, way = text[text.index("| room |") :].split("## One sample, from the bag to the report")
    rows = [row.split("|")[1] for row in plan.splitlines() if row.startswith("| `")]
    told = {name for row in rows for name in re.findall(r"`([a-z_/]+)`", row)}
    for room in {"/".join(room.split(".")[:2]) for room in ROOMS if "." in room}:
        assert room in told or room.split("/")[1] in told, f"the map of CONTRIBUTING.md lacks {room}"
    files = {path.relative_to(ROOT).as_posix() for path in MODULES}
    for name in re.findall(r"`([a-z_/]+\.py)`", way.split("\n## ")[0]):
        assert any(path == name or path.endswith(f"/{name}") for path in files), name
