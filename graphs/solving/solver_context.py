# SPDX-License-Identifier: BSD-3-Clause
"""How the solver uses numpy: one BLAS thread, and no warnings where results are checked.

The solver calls BLAS very often for matrices of a dozen rows. Threads gain nothing there and wait for each other:
on two busy cores a calibration took four times as long with them. Steps that are not finite are rejected or become a
SolveError, so numpy need not warn about them.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

P = ParamSpec("P")
R = TypeVar("R")


def in_solver_context(function: Callable[P, R]) -> Callable[P, R]:
    """Runs a function with one BLAS thread and without numpy's warnings, and restores both afterwards."""

    @functools.wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        with threadpool_limits(limits=1, user_api="blas"), np.errstate(all="ignore"):
            return function(*args, **kwargs)

    return limited
