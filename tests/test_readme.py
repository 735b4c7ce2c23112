# SPDX-License-Identifier: BSD-3-Clause
"""Commands of README and docs do what they say: the marked blocks of a page are executed, in order, in one folder."""

from __future__ import annotations

import os
import re
import subprocess
import sysconfig
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="the README simulates its recordings")

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")])
SHOWN = re.compile(r"<!-- executed by tests/test_readme.py -->\n```bash\n(.*?)```", re.DOTALL)
BEFORE = re.compile(r"<!-- before, by tests/test_readme.py:\n(.*?)-->", re.DOTALL)
"""What a page takes for granted: the reader's own files are made up by these commands."""


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def commands(page: Path) -> list[str]:
    blocks = [*BEFORE.findall(text_of(page)), *SHOWN.findall(text_of(page))]
    return [line for block in blocks for line in block.replace("\\\n", " ").splitlines() if line.strip()]


def named(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


EXECUTED = [page for page in PAGES if SHOWN.search(text_of(page))]


def run(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([sysconfig.get_path("scripts"), os.environ["PATH"]])
    return subprocess.run(
        command, shell=True, cwd=folder, env={**os.environ, "PATH": path}, capture_output=True, text=True, timeout=600
    )


@pytest.mark.slow
@pytest.mark.parametrize("page", EXECUTED, ids=named)
def test_the_commands_of_a_page_work_and_write_what_they_name(page, tmp_path):
    for command in commands(page):
        done = run(command, tmp_path)
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
        assert done.stderr == "", command
    files = {name for command in commands(page) for name in re.findall(r"[\w.]+\.(?:mcap|yaml|html|rrd|csv)", command)}
    assert files <= {file.name for file in tmp_path.iterdir()}


def test_pages_with_commands_are_executed():
    assert "docs/first_steps.md" in map(named, EXECUTED)


def test_the_make_targets_that_are_named_exist():
    makefile = text_of(ROOT / "Makefile")
    targets = set(re.findall(r"^([\w-]+):", makefile, re.MULTILINE))
    for page in PAGES:
        assert set(re.findall(r"`make ([\w-]+)", text_of(page))) <= targets, page


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", text_of(page)):
        assert (page.parent / link).exists(), link
