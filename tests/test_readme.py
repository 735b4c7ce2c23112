# SPDX-License-Identifier: BSD-3-Clause
"""The commands of the README do what it says: the marked blocks are executed, in order, in one folder."""

from __future__ import annotations

import os
import re
import subprocess
import sysconfig
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="the README simulates its recordings")

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"<!-- executed by tests/test_readme.py -->\n```bash\n(.*?)```", re.DOTALL)
COMMANDS = [line for block in BLOCK.findall(README) for line in block.splitlines() if line.strip()]


def run(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([sysconfig.get_path("scripts"), os.environ["PATH"]])
    return subprocess.run(
        command, shell=True, cwd=folder, env={**os.environ, "PATH": path}, capture_output=True, text=True, timeout=600
    )


@pytest.mark.slow
def test_the_commands_of_the_readme_work_and_write_what_they_name(tmp_path):
    assert len(COMMANDS) >= 6
    for command in COMMANDS:
        done = run(command, tmp_path)
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
        assert done.stderr == "", command
    named = {name for command in COMMANDS for name in re.findall(r"[\w.]+\.(?:mcap|yaml|html|rrd)", command)}
    assert named <= {file.name for file in tmp_path.iterdir()}


def test_the_make_targets_that_the_readme_names_exist():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^(\w+):", makefile, re.MULTILINE))
    assert set(re.findall(r"\bmake (\w+)", README)) - {"and"} <= targets


def test_the_links_of_the_readme_lead_somewhere():
    for link in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / link).exists(), link
