# SPDX-License-Identifier: BSD-3-Clause
"""Errors of one recording among several say which one it is."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from jointscope.robots.errors import RecordingError


@contextmanager
def errors_of(path: str | Path) -> Iterator[None]:
    """Names a recording in errors that do not.

    Args:
        path: of the bag.
    """
    try:
        yield
    except RecordingError as err:
        if str(path) in str(err):
            raise
        raise RecordingError(f"{path}: {err}") from err
