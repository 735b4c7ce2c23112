# SPDX-License-Identifier: BSD-3-Clause
"""Rows of a long benchmark, one line of JSON each, so that an interrupted run goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jointscope.graphs

ROOMS = ("robots", "factors", "graphs", "tools/simulator")  # what simulated recordings and their results depend on
SUFFIXES = (".py", ".yaml", ".urdf")


def keep(path: Path, code: str, row: Mapping[str, Any]) -> None:
    """Appends a row to the results file, with the code that measured it."""
    with path.open("a", encoding="utf-8") as lines:
        lines.write(json.dumps({"code": code, **row}) + "\n")


def known_rows(path: Path, code: str) -> dict[str, dict[str, Any]]:
    """Rows of an earlier run with the same code, by name."""
    found: dict[str, dict[str, Any]] = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else ():
        try:
            content = json.loads(line)
        except json.JSONDecodeError:
            continue  # the run was interrupted here
        if content.pop("code") == code:
            found[content["name"]] = content
    return found


def code_of(benchmark: str) -> str:
    """A fingerprint of everything that a row depends on.

    Args:
        benchmark: `__file__` of the program that measures.
    """
    root = Path(jointscope.graphs.__file__).resolve().parents[1]
    files = [f for room in ROOMS for f in sorted((root / room).rglob("*")) if f.suffix in SUFFIXES]
    return hashlib.sha256(b"".join(f.read_bytes() for f in [*files, Path(benchmark)])).hexdigest()[:12]
