# SPDX-License-Identifier: BSD-3-Clause
"""`docs/measured.md`: each benchmark writes its own section, with the date, the commit and the kind of machine."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import re
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "measured.md"
PACKAGES = ("numpy", "scipy", "gtsam", "pin", "mujoco", "numba", "rosbags")


def write_section(text: str, part: str = "") -> None:
    """Puts what this program measured into the page, in place of what it wrote there before, else at its end.

    Args:
        text: markdown, with a heading of the second level.
        part: of a benchmark that measures several things, as on its command line.
    """
    program = Path(sys.argv[0])
    words = re.sub(r"\W+", " ", part)  # an option as it is typed is no name
    name = f"{program.stem} {words}".strip()
    heading, _, body = text.strip().partition("\n")
    typed = f"python benchmarks/{program.name} {part}".strip()
    told = f"Measured {datetime.now(UTC):%Y-%m-%d} at commit {commit()} by `{typed}` on {environment()}."
    section = f"<!-- {name} -->\n{heading}\n\n{told}\n\n{body.strip()}\n<!-- end of {name} -->"
    page = PAGE.read_text(encoding="utf-8")
    known = re.search(rf"<!-- {re.escape(name)} -->\n.*?<!-- end of {re.escape(name)} -->", page, re.DOTALL)
    page = page[: known.start()] + section + page[known.end() :] if known else f"{page.rstrip()}\n\n{section}\n"
    PAGE.write_text(page, encoding="utf-8")


def commit() -> str:
    """The commit of the tree, and whether anything but the page itself was changed since; "unknown" without git."""
    try:
        head = _git("rev-parse", "--short", "HEAD")
        changed = _git("status", "--porcelain", "--untracked-files=no", "--", ".", f":!{PAGE.relative_to(ROOT)}")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return f"{head} with changes" if changed else head


def environment() -> str:
    """Cores, memory, load, Python and package versions in one line."""
    versions = []
    for package in PACKAGES:
        try:
            versions.append(f"{package} {importlib.metadata.version(package)}")
        except importlib.metadata.PackageNotFoundError:
            versions.append(f"{package} not installed")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    # other work on the machine makes every time below longer; the load tells
    load = f"load {os.getloadavg()[0]:.1f}, " if hasattr(os, "getloadavg") else ""
    return (
        f"{cores} cores of {platform.machine()}, {memory:.0f} GiB, {load}Python {platform.python_version()}, "
        f"{', '.join(versions)}"
    )


def _git(*arguments: str) -> str:
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
