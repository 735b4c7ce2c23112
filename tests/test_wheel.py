# SPDX-License-Identifier: BSD-3-Clause
"""The wheel holds every package and data file, and puts nothing but `jointscope` into site-packages."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("robots", "factors", "graphs", "tools")
DATA = {".yaml", ".urdf", ".css", ".js"}

pytestmark = pytest.mark.skipif(
    int(version("setuptools").split(".")[0]) < 77, reason="needs setuptools >= 77, which `make test` installs"
)


@pytest.fixture(scope="module")
def content(tmp_path_factory):
    """Names of the files in a wheel built from a copy of the sources, without network."""
    source, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    for room in ROOMS:
        shutil.copytree(ROOT / room, source / room, ignore=shutil.ignore_patterns("__pycache__"))
    command = [sys.executable, "-m", "pip", "wheel", str(source), "--no-deps", "--no-build-isolation", "-w", str(out)]
    built = subprocess.run(command, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    (wheel,) = out.glob("*.whl")
    return set(zipfile.ZipFile(wheel).namelist())


def in_wheel(path: Path) -> str:
    """Where a file of the tree belongs in the wheel."""
    name = path.relative_to(ROOT).as_posix()
    return f"jointscope/{name.removeprefix('tools/facade/') if name.startswith('tools/facade/') else name}"


def test_every_module_and_data_file_is_in_the_wheel(content):
    files = [path for room in ROOMS for path in (ROOT / room).rglob("*") if path.is_file()]
    wanted = {in_wheel(path) for path in files if path.suffix in {".py", *DATA}}
    assert len(wanted) > 50
    assert wanted - content == set()


def test_type_checkers_see_that_the_package_is_typed(content):
    assert "jointscope/py.typed" in content


def test_every_package_has_an_init_file(content):
    folders = {name.rpartition("/")[0] for name in content if name.endswith(".py")}
    assert {folder for folder in folders if f"{folder}/__init__.py" not in content} == set()


def test_nothing_but_jointscope_lands_in_site_packages(content):
    top = {name.split("/")[0] for name in content}
    assert {name for name in top if not name.endswith(".dist-info")} == {"jointscope"}
    assert not any("facade" in name or "/tests/" in name for name in content)


def test_the_command_and_the_licence_come_along(content):
    assert any(name.endswith("entry_points.txt") for name in content)
    assert any(name.endswith("LICENSE") for name in content)
