# SPDX-License-Identifier: BSD-3-Clause
"""The marked commands of README and docs, executed in order in one folder."""

from __future__ import annotations

import os
import re
import subprocess
import sysconfig
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")])
SHOWN = re.compile(r"<!-- executed by tests/test_readme.py -->\n```(bash|python)\n(.*?)```", re.DOTALL)
BEFORE = re.compile(r"<!-- before, by tests/test_readme.py:\n(.*?)-->", re.DOTALL)
"""What a page takes for granted: the reader's own files are made up by these commands, in which $PAGE is the page."""


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def commands(page: Path) -> list[str]:
    found = [line for block in BEFORE.findall(text_of(page)) for line in lines_of(block)]
    for language, block in SHOWN.findall(text_of(page)):
        found += lines_of(block) if language == "bash" else [f"python - <<'END'\n{block}END"]
    return found


def lines_of(block: str) -> list[str]:
    """The commands of a block, one each, without comments."""
    lines = (line.partition("  #")[0] for line in block.replace("\\\n", " ").splitlines())
    return [line for line in lines if line.strip()]


PICTURE = re.compile(r"\]\((?:\.\./)?pictures/(?:pages|robots)/([\w.-]+)\)")
TITLE = re.compile(r"<text class=\"title\"[^>]*>([^<]*)")


def pictures(page: Path) -> dict[str, Path]:
    """Pictures that a page shows and that its commands write: FOLDER-FILE.svg is FILE.svg in what --figures names."""
    return {name: Path(*name.split("-", 1)) for name in PICTURE.findall(text_of(page))}


def check_pictures(page: Path, folder: Path) -> None:
    """The commands have drawn what the page shows; numbers in a drawing are those of the machine that drew it."""
    for name, made in pictures(page).items():
        (kept,) = (ROOT / "docs" / "pictures").glob(f"*/{name}")
        assert "<svg" in text_of(folder / made), name
        assert TITLE.findall(text_of(folder / made)) == TITLE.findall(text_of(kept)), name


def named(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


EXECUTED = [page for page in PAGES if SHOWN.search(text_of(page))]


def run(command: str, folder: Path, page: Path = ROOT) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([sysconfig.get_path("scripts"), os.environ["PATH"]])
    environment = {**os.environ, "PATH": path, "PAGE": str(page)}
    return subprocess.run(
        command, shell=True, cwd=folder, env=environment, capture_output=True, text=True, timeout=1200
    )


def check_commands(page: Path, folder: Path) -> None:
    """Every command of a page works without a word on standard error, and the files that it names are there."""
    for command in commands(page):
        done = run(command, folder, page)
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
        assert done.stderr == "", f"{command}\n{done.stderr}"
    files = {name for command in commands(page) for name in re.findall(r"[\w.]+\.(?:mcap|yaml|html|rrd|csv)", command)}
    assert files <= {file.name for file in folder.rglob("*")}
    check_pictures(page, folder)
