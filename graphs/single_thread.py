# SPDX-License-Identifier: BSD-3-Clause
"""One BLAS thread while small matrices are at work.

The solver calls BLAS very often for matrices of a dozen rows. Threads gain nothing there and wait for each other:
on two busy cores a calibration took four times as long with them.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

P = ParamSpec("P")
R = TypeVar("R")


def single_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Runs a function with one BLAS thread and restores the setting afterwards."""

    @functools.wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        with threadpool_limits(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited
