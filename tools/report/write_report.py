# SPDX-License-Identifier: BSD-3-Clause
"""A report on disk: written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from jointscope.robots.errors import JointscopeError


def write_report(path: str | Path, html: str) -> None:
    """Writes the page beside its place and moves it there.

    Args:
        path: file to write; an existing one is replaced.
        html: the page.

    Raises:
        JointscopeError: the file cannot be written (no folder, no permission, disk full); nothing is left behind.
    """
    target = Path(path)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        temporary.write_text(html, encoding="utf-8")
        os.replace(temporary, target)
    except OSError as err:
        raise JointscopeError(f"cannot write the report {target}: {err.strerror or err}") from err
    finally:
        # the folder itself may be missing or be a file
        if temporary.exists():
            temporary.unlink()
