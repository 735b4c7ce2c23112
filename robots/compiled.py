# SPDX-License-Identifier: BSD-3-Clause
"""Functions that numba compiles at their first call. Import this where something is solved, not before: it costs time.

The machine code is kept on disk: beside the source, or in the user's folder for caches where the source cannot be
written (or in NUMBA_CACHE_DIR). Where neither can be written it is compiled anew in each process.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

# sums may be reordered and products fused; NaN and infinity keep their meaning, since callers ask for them
ARITHMETIC = {"contract", "reassoc", "nsz", "arcp"}
OPTIONS: dict[str, Any] = {"fastmath": ARITHMETIC, "nogil": True, "error_model": "numpy"}  # 1 / 0 is infinite


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function in machine code; it lets other threads run beside it."""
    try:
        return numba.njit(cache=True, **OPTIONS)(function)
    except RuntimeError:  # there is no folder that can be written
        return numba.njit(**OPTIONS)(function)
