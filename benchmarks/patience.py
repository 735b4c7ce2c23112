# SPDX-License-Identifier: BSD-3-Clause
"""One line on stderr about what is going on, so that stdout holds nothing but the tables."""

from __future__ import annotations

import sys
import time

_started = time.perf_counter()


def say(text: str) -> None:
    """Tells what begins now, with the seconds since the start."""
    print(f"[{time.perf_counter() - _started:6.0f} s] {text}", file=sys.stderr, flush=True)
