# SPDX-License-Identifier: BSD-3-Clause
"""How the solver uses the machine: one BLAS thread, threads of its own, and no warnings where results are checked.

The solver calls BLAS very often for matrices of a dozen rows. Threads gain nothing there and wait for each other:
on two busy cores a calibration took four times as long with them. Stretches of a recording are large enough: they are
worked on side by side, each by one thread, and what they say is summed in their order, so that no result depends on the
number of threads. Steps that are not finite are rejected or become a SolveError, so numpy need not warn about them.
"""

from __future__ import annotations

import ctypes
import functools
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sized
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import copy_context
from typing import ParamSpec, TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")

LIMITS = ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS")  # what users and batch systems say how many threads may run
AHEAD = 2  # results for each thread that may wait until they are asked for

_here = threading.local()  # in a thread of ours: that it is one
_pools: dict[int, ThreadPoolExecutor] = {}


def in_solver_context(function: Callable[P, R]) -> Callable[P, R]:
    """Runs a function with one BLAS thread and without numpy's warnings, and restores both afterwards."""

    @functools.wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        with threadpool_limits(limits=1, user_api="blas"), np.errstate(all="ignore"):
            return function(*args, **kwargs)

    return limited


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def thread_count() -> int:
    """Threads that work side by side: one for each core, or as many as the environment allows."""
    told = [os.environ.get(name, "") for name in LIMITS]
    return min([available_cores(), *(max(int(value), 1) for value in told if value.isdigit())])


def work_alone() -> None:
    """One thread from now on: this process is one of several that share the cores."""
    os.environ[LIMITS[0]] = "1"


@functools.cache
def _trim() -> Callable[[int], int] | None:
    """malloc_trim of glibc; other C libraries do not have it, or need none."""
    try:
        found: Callable[[int], int] | None = getattr(ctypes.CDLL(None), "malloc_trim", None)
    except (OSError, TypeError):
        return None
    return found


def give_back_memory() -> None:
    """Hands freed memory back to the system: after a solve glibc keeps a third of all that a process ever used."""
    if (trim := _trim()) is not None:
        trim(0)


def side_by_side(function: Callable[[T], R], tasks: Iterable[T], threads: int = 0) -> Iterator[R]:
    """Results of function(task) in the order of the tasks, a few of them worked on at once.

    Args:
        function: lets other threads run beside it where it takes long, as numpy and compiled kernels do.
        tasks: taken as they are needed; they may not need each other.
        threads: how many; `thread_count()` if 0.
    """
    threads = 1 if isinstance(tasks, Sized) and len(tasks) < 2 else threads or thread_count()
    if threads < 2 or getattr(_here, "is_ours", False):  # who waits for its own kind may wait forever
        yield from map(function, tasks)
        return
    pool, running = _pool(threads), deque[Future[R]]()
    try:
        for task in tasks:
            running.append(pool.submit(copy_context().run, function, task))
            if len(running) >= AHEAD * threads:
                yield running.popleft().result()
        while running:
            yield running.popleft().result()
    finally:
        for future in running:
            future.cancel()


def _pool(threads: int) -> ThreadPoolExecutor:
    if threads not in _pools:
        _pools[threads] = ThreadPoolExecutor(threads, "jointscope", lambda: setattr(_here, "is_ours", True))
    return _pools[threads]
