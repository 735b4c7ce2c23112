# SPDX-License-Identifier: BSD-3-Clause
"""Fits that do not need each other, on several cores: processes that begin when there is something to do for two.

What is decided is decided in the order of the tasks, as if they ran one after the other; a result that came too late
to matter is thrown away. So no answer depends on the number of cores.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import tempfile
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

from jointscope.graphs.solving.batch_solver import Solver, solve
from jointscope.graphs.spread.spread_solver import SpreadSolver
from jointscope.graphs.workers.crew import WorkerLost
from jointscope.graphs.workers.dask_cluster import DaskCluster
from jointscope.graphs.workers.local_processes import LocalProcesses, made_ready

T = TypeVar("T")
R = TypeVar("R")

ATTEMPTS = 2  # times that a task is given to processes before it is done here
_known: dict[str, Any] = {}  # in a worker: what its last task needed, by file


def solver_of(workers: SideBySide | None) -> Solver:
    """Who minimises the cost of all samples: workers, where there are any."""
    return solve if workers is None else workers.solver


class SideBySide:
    """Worker processes, started when they are first needed.

    Args:
        workers: processes; with 1 everything is done in this one.
        effect_files: Python files with effects of the user's own, which workers read, too.
        cluster: does everything, if it is given; it knows the user's effects already.
    """

    def __init__(self, workers: int = 1, effect_files: Sequence[Path] = (), cluster: DaskCluster | None = None):
        self.workers = workers
        self.cluster = cluster
        self._keepers = LocalProcesses(workers, effect_files)
        self._solver = SpreadSolver(cluster or self._keepers)
        self._effect_files = tuple(effect_files)
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> SideBySide:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, err: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop()
        self._keepers.__exit__(kind, err, trace)

    @property
    def solver(self) -> SpreadSolver:
        """Solves with recordings spread over the same workers; processes that keep them begin where there are two."""
        return self._solver

    def begin(self, tasks: int) -> None:
        """Starts processes for a number of tasks to come, which are ready by then; what they import takes a second."""
        count = min(self.workers, tasks)
        if count > 1 and self._pool is None and self.cluster is None:
            for _ in range(count):
                self._processes().submit(os.getpid)

    def in_order(self, function: Callable[[Any, T], R], shared: Any, tasks: Sequence[T]) -> Generator[R]:
        """Results of function(shared, task) in the order of the tasks; who stops asking stops the rest.

        Args:
            function: of a module, so that workers find it.
            shared: what all tasks need; it is handed to each worker once.
            tasks: small.
        """
        if self.cluster is not None:
            yield from _on_cluster(self.cluster, function, shared, tasks)
            return
        if self.workers < 2 or len(tasks) < 2:
            yield from (function(shared, task) for task in tasks)
            return
        with tempfile.TemporaryDirectory(prefix="jointscope-") as folder:
            file = Path(folder) / "shared"
            file.write_bytes(pickle.dumps(shared, pickle.HIGHEST_PROTOCOL))
            running: dict[int, Future[R]] = {}
            try:
                for i in range(len(tasks)):
                    for ahead in range(i, min(i + self.workers, len(tasks))):
                        if ahead not in running:
                            running[ahead] = self._submit(function, file, tasks[ahead])
                    yield self._result(running, i, function, file, tasks[i], shared)
                    del running[i]
            finally:
                if running:
                    self._stop()  # nobody waits for them

    def _result(
        self, running: dict[int, Future[R]], i: int, function: Callable[[Any, T], R], file: Path, task: T, shared: Any
    ) -> R:
        """One result; a worker that was killed costs its tasks a second attempt, and nothing else."""
        for _ in range(ATTEMPTS):
            try:
                return running[i].result()
            except BrokenProcessPool:
                self._stop()
                for other in [k for k in running if k != i]:
                    del running[other]
                running[i] = self._submit(function, file, task)
        return function(shared, task)

    def _submit(self, function: Callable[[Any, T], R], file: Path, task: T) -> Future[R]:
        return self._processes().submit(_run, function, str(file), task)

    def _processes(self) -> ProcessPoolExecutor:
        if self._pool is None:
            spawn = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(self.workers, spawn, _begin, (self._effect_files,))
        return self._pool

    def _stop(self) -> None:
        """Ends the processes, whatever they are doing."""
        if self._pool is None:
            return
        processes = list((self._pool._processes or {}).values())
        self._pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.terminate()
        self._pool = None


def _on_cluster(cluster: DaskCluster, function: Callable[[Any, T], R], shared: Any, tasks: Sequence[T]) -> Generator[R]:
    """As `SideBySide.in_order`."""
    handle, running = cluster.share(shared), dict[int, Any]()
    try:
        for i in range(len(tasks)):
            for ahead in range(i, min(i + cluster.slots, len(tasks))):
                if ahead not in running:
                    running[ahead] = cluster.submit(ahead % cluster.slots, function, handle, tasks[ahead])
            for _ in range(ATTEMPTS):
                try:
                    result = running[i].result()
                    break
                except WorkerLost:  # perhaps with the only copy of what is shared
                    handle = cluster.share(shared)
                    running[i] = cluster.submit(i % cluster.slots, function, handle, tasks[i])
            else:
                result = function(shared, tasks[i])
            del running[i]
            yield result
    finally:
        for pending in running.values():
            pending.drop()


def _begin(effect_files: tuple[Path, ...]) -> None:
    """Makes a worker ready, with the modules that it will need; the process that asked handles Ctrl-C."""
    made_ready(effect_files)
    from jointscope.graphs.discovery import diagnose  # noqa: F401
    from jointscope.graphs.kernels import band_kernel  # noqa: F401


def _run(function: Callable[[Any, Any], Any], file: str, task: Any) -> Any:
    if file not in _known:
        _known.clear()
        _known[file] = pickle.loads(Path(file).read_bytes())
    return function(_known[file], task)
