# SPDX-License-Identifier: BSD-3-Clause
"""A report on disk: written whole or not at all."""

from __future__ import annotations

from pathlib import Path

from jointscope.tools.writing.whole_file import whole_file


def write_report(path: str | Path, html: str) -> None:
    """Writes the page beside its place and moves it there.

    Args:
        path: file to write; an existing one is replaced.
        html: the page.

    Raises:
        JointscopeError: the file cannot be written (no folder, no permission, disk full); nothing is left behind.
    """
    with whole_file(path) as unfinished:
        unfinished.write_text(html, encoding="utf-8")
