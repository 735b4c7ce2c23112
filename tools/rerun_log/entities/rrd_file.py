# SPDX-License-Identifier: BSD-3-Clause
"""An .rrd file that is written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from jointscope.robots.errors import JointscopeError
from jointscope.tools.writing.whole_file import whole_file

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

APPLICATION = "jointscope"
ROOM_FACTOR = 1.25  # the viewer's format needs a little more than the numbers themselves


@contextmanager
def rrd_file(path: str | Path, blueprint: rrb.Blueprint, expected_bytes: int = 0) -> Iterator[rr.RecordingStream]:
    """A stream to log to; the file appears at its place when the block ends without an error.

    Args:
        path: file to write; an existing one is replaced.
        blueprint: layout that the viewer opens with.
        expected_bytes: how much will be written, to find out early that the disk is too small [byte].

    Yields:
        The stream.

    Raises:
        JointscopeError: the file cannot be written; nothing is left behind.
    """
    import rerun as rr

    _check_room(Path(path), expected_bytes)
    with whole_file(path) as unfinished:
        # the viewer's writer works in the background and only logs its errors: create the file ourselves first
        unfinished.touch()
        stream = rr.RecordingStream(APPLICATION)
        stream.set_log_time_enabled(False)
        stream.save(unfinished, default_blueprint=blueprint)
        try:
            yield stream
            stream.flush()
        finally:
            stream.disconnect()
        _check_complete(unfinished)


def _check_room(target: Path, expected_bytes: int) -> None:
    """Asks the disk before the work, as the background writer cannot tell afterwards."""
    try:
        disk = os.statvfs(target.parent)
    except OSError:
        return  # the folder is missing; writing will say so
    free = disk.f_bavail * disk.f_frsize
    if free < ROOM_FACTOR * expected_bytes:
        raise JointscopeError(
            f"cannot write {target}: about {expected_bytes / 1e6:.0f} MB are needed, {free / 1e6:.0f} MB are free"
        )


def _check_complete(file: Path) -> None:
    """The format ends with a footer that is written last; a file without it was cut off."""
    from rerun.chunk import RrdReader

    try:
        RrdReader(str(file)).store().schema()
    except Exception as err:
        raise JointscopeError(f"cannot write {file}: the viewer's file is not complete") from err
