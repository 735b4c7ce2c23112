# SPDX-License-Identifier: BSD-3-Clause
"""Processes on this machine, one in each slot."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from jointscope.graphs.solving.solver_context import work_alone
from jointscope.graphs.workers.crew import WorkerLost

MEMORY_LINE = "MemAvailable:"


class LocalProcesses:
    """A crew of processes, each begun when it is first needed.

    Args:
        slots: how many.
        effect_files: Python files with effects of the user's own, which they read, too.
    """

    name = "local processes"

    def __init__(self, slots: int, effect_files: Sequence[Path] = ()):
        self.slots = slots
        self._effect_files = tuple(effect_files)
        self._pools: dict[int, ProcessPoolExecutor] = {}

    def __enter__(self) -> LocalProcesses:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, err: BaseException | None, trace: TracebackType | None
    ) -> None:
        for slot in list(self._pools):
            self.end(slot)

    @property
    def memories(self) -> list[tuple[float, list[int]]]:
        """All slots share what this machine has left [bytes]."""
        return [(available_memory(), list(range(self.slots)))]

    def submit(self, slot: int, function: Callable[..., Any], *args: Any) -> _Pending:
        """Begins function(*args) in the process of a slot."""
        try:
            return _Pending(self, slot, self._pool(slot).submit(function, *args))
        except BrokenProcessPool:  # it died while it had nothing to do
            self.end(slot)
            return _Pending(self, slot, self._pool(slot).submit(function, *args))

    def end(self, slot: int) -> None:
        """Ends a process, whatever it is doing; the next task of its slot begins another."""
        pool = self._pools.pop(slot, None)
        if pool is None:
            return
        processes = list((pool._processes or {}).values())
        pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.terminate()

    def _pool(self, slot: int) -> ProcessPoolExecutor:
        if slot not in self._pools:
            spawn = multiprocessing.get_context("spawn")
            self._pools[slot] = ProcessPoolExecutor(1, spawn, made_ready, (self._effect_files,))
        return self._pools[slot]


@dataclass
class _Pending:
    """A result of a process."""

    crew: LocalProcesses
    slot: int
    future: Future[Any]

    def result(self) -> Any:
        """Waits for it."""
        try:
            return self.future.result()
        except BrokenProcessPool as err:
            self.crew.end(self.slot)
            raise WorkerLost from err


def made_ready(effect_files: Sequence[Path]) -> None:
    """Prepares a process: it knows the user's effects, is one of many, and Ctrl-C is for the one that asked."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    work_alone()
    from jointscope.robots.files.effect_catalogue import add_user_effects

    for file in effect_files:
        add_user_effects(file)


def available_memory() -> float:
    """What processes on this machine may still take [bytes]; infinite where the system does not tell."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:
        return float("inf")
    found = [line.split()[1] for line in lines if line.startswith(MEMORY_LINE)]
    return 1024.0 * float(found[0]) if found else float("inf")
