# SPDX-License-Identifier: BSD-3-Clause
"""A progress bar on a terminal, for work that takes long enough to wonder about."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

Progress = Callable[[str, float], None]

QUIET_SECONDS = 2.0  # [s] shorter work needs no progress bar
REDRAW_SECONDS = 0.1  # [s]
WIDTH = 30  # characters
ERASE_LINE = "\r\x1b[K"


@contextmanager
def progress_bar(stream: TextIO | None = None) -> Iterator[Progress]:
    """Shows a bar after two seconds and takes it away at the end; shows nothing where no one looks.

    Args:
        stream: where to draw; standard error by default.

    Yields:
        A function to be called with a text and the share done, 0 to 1.
    """
    stream = stream or sys.stderr
    if not stream.isatty():
        yield lambda text, share: None
        return
    bar = _Bar(stream)
    try:
        yield bar.show
    finally:
        bar.erase()


def reading(bag: Path, progress: Progress) -> Callable[[int, int], None]:
    """What a bag reader calls with the number of messages read and expected."""
    return lambda done, expected: progress(f"reading {bag.name}", done / max(expected, 1))


class _Bar:
    """One line on a terminal that is drawn again and again."""

    def __init__(self, stream: TextIO):
        self._stream = stream
        self._begin = time.monotonic()
        self._drawn = 0.0

    def show(self, text: str, share: float) -> None:
        now = time.monotonic()
        if now - self._begin < QUIET_SECONDS or now - self._drawn < REDRAW_SECONDS:
            return
        self._drawn = now
        share = min(max(share, 0.0), 1.0)
        filled = "#" * round(WIDTH * share)
        self._stream.write(f"{ERASE_LINE}[{filled:<{WIDTH}}] {share:4.0%} {now - self._begin:4.0f} s  {text[:40]}")
        self._stream.flush()

    def erase(self) -> None:
        if self._drawn:
            self._stream.write(ERASE_LINE)
            self._stream.flush()
