# SPDX-License-Identifier: BSD-3-Clause
"""The workers of a Dask cluster that is there already, one slot for each of their threads.

A task is bound to the worker of its slot, which keeps what it needs; where that worker is gone, the slot gets another
one of the cluster. What a worker keeps is not Dask's: who gave it gives it again.
"""

from __future__ import annotations

import logging
import re
import time
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from platform import python_version, python_version_tuple
from types import TracebackType
from typing import Any

from jointscope.graphs.workers.crew import WorkerLost
from jointscope.robots.errors import ClusterError

SAME = (
    "distributed",
    "jointscope",
    "numpy",
    "scipy",
    "gtsam",
    "numba",
    "pin",
)  # packages of which workers need our version
ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx|ucxx)://[^/\s]+:\d+")  # protocols of Dask, and where it listens
EXPECTED = "expected an address like tcp://host:8786, as `dask scheduler` prints it when it starts"
CONNECT = 5.0  # [s] to answer
LOOK = 1.0  # [s] after which a worker that has not answered is looked for
RETURN = 60.0  # [s] for a worker to come back where none is left


class DaskCluster:
    """A crew on a cluster.

    Args:
        address: of its scheduler, "tcp://host:8786".
        effect_files: Python files with effects of the user's own, which workers get, too.

    Raises:
        ClusterError: `distributed` is not installed here, nobody answers, no worker is there, or versions differ.
    """

    def __init__(self, address: str, effect_files: Sequence[Path] = ()):
        try:
            from distributed import Client
        except ImportError as err:
            raise ClusterError('--scheduler needs Dask: pip install "jointscope[cluster]"') from err
        self._address, self._open = address, ExitStack()
        if not ADDRESS.fullmatch(address):
            raise ClusterError(f"--scheduler: got {address!r}; {EXPECTED}")
        try:
            with _quiet():
                self._client = Client(address, timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError, ImportError) as err:
            raise ClusterError(f"no Dask scheduler answers at {address} ({err}); {EXPECTED}") from err
        try:
            self._workers = self._alive()
            if not self._workers:
                raise ClusterError(f"the cluster at {address} has no workers; start some: `dask worker {address}`")
            self._check_versions()
            self._send_effects(effect_files)
        except BaseException:
            self._client.close()
            raise
        self.of_slot = [worker for worker, about in self._workers.items() for _ in range(about["nthreads"])]

    def __enter__(self) -> DaskCluster:
        self._open.enter_context(_quiet())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, err: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client.close()
        self._open.close()

    @property
    def name(self) -> str:
        """The cluster by its address."""
        return f"workers of {self._address}"

    @property
    def slots(self) -> int:
        """Threads of all workers."""
        return len(self.of_slot)

    @property
    def memories(self) -> list[tuple[float, list[int]]]:
        """What each worker may still take [bytes], by its limit and what it has already, with its slots."""
        found = []
        for worker, about in self._workers.items():
            limit = float(about.get("memory_limit") or float("inf"))
            used = float(about.get("metrics", {}).get("memory", 0.0))
            found.append((limit - used, [i for i, other in enumerate(self.of_slot) if other == worker]))
        return found

    def share(self, content: Any) -> Any:
        """Hands something to all workers; what comes back stands for it among the arguments of a task."""
        return self._client.scatter([content], broadcast=True, hash=False)[0]

    def submit(self, slot: int, function: Callable[..., Any], *args: Any) -> _Pending:
        """Begins function(*args) on the worker of a slot."""
        worker = self.of_slot[slot]
        future = self._client.submit(function, *args, workers=[worker], pure=False, retries=0)
        return _Pending(self, slot, worker, future)

    def check(self, slot: int, worker: str) -> None:
        """Looks whether a worker is still there; if not, its slot gets another one.

        Raises:
            WorkerLost: it is gone.
            ClusterError: so is the scheduler, or all workers.
        """
        if worker in self._alive():
            return
        if self.of_slot[slot] == worker:
            self.replace(slot)
        raise WorkerLost

    def replace(self, slot: int) -> None:
        """Fills a slot with the worker that has the fewest."""
        end = time.monotonic() + RETURN
        while not (alive := self._alive()):
            if time.monotonic() > end:
                raise ClusterError(f"all workers of the cluster at {self._address} are gone; nothing was written")
            time.sleep(LOOK)
        self.of_slot[slot] = min(alive, key=self.of_slot.count)

    def _alive(self) -> dict[str, Any]:
        """What the scheduler knows of each worker, by address."""
        if self._client.status != "running":
            raise ClusterError(f"the scheduler at {self._address} is gone; nothing was written")
        try:
            return dict(self._client.scheduler_info(n_workers=-1)["workers"])
        except (OSError, TimeoutError) as err:
            raise ClusterError(f"the scheduler at {self._address} is gone ({err}); nothing was written") from err

    def _check_versions(self) -> None:
        """All workers must compute what this process would."""
        major, minor, _ = python_version_tuple()
        self._check("Python", f"{major}.{minor}.", python_version)
        for package in SAME:
            self._check(package, version_here(package), version, package)

    def _check(self, what: str, own: str, ask: Callable[..., str], *args: str) -> None:
        """A version that all workers must have."""
        for worker, other in self._client.run(ask, *args, on_error="return").items():
            if isinstance(other, BaseException):
                raise ClusterError(
                    f"worker {worker}: {what} is not installed there ({other}); install {what} {own} in the "
                    "environment of the workers, and restart them"
                )
            if not other.startswith(own):
                raise ClusterError(
                    f"worker {worker} has {what} {other}, expected {own} as here; install the same version in the "
                    "environment of the workers, and restart them"
                )

    def _send_effects(self, files: Sequence[Path]) -> None:
        from jointscope.graphs.workers.worker_effects import WorkerEffects

        if files:
            texts = {str(file.resolve()): file.read_text(encoding="utf-8") for file in files}
            self._client.register_plugin(WorkerEffects(texts))


def version_here(package: str) -> str:
    """Version of a package in this process."""
    return version(package)


@dataclass
class _Pending:
    """A result of a cluster."""

    crew: DaskCluster
    slot: int
    worker: str
    future: Any

    def drop(self) -> None:
        """Nobody waits for it any more; what has begun ends by itself."""
        self.future.cancel()

    def result(self) -> Any:
        """Waits for it, and looks from time to time whether somebody still works on it."""
        from distributed import TimeoutError as Later
        from distributed.scheduler import KilledWorker

        while True:
            try:
                return self.future.result(timeout=LOOK)
            except Later:
                self.crew.check(self.slot, self.worker)
            except (CancelledError, KilledWorker, OSError) as err:
                self.crew.check(self.slot, self.worker)
                self.crew.replace(self.slot)
                raise WorkerLost from err


class _quiet:
    """No lines of Dask's own about a connection that fails: the error says it."""

    def __enter__(self) -> None:
        self._level = logging.getLogger("distributed").level
        logging.getLogger("distributed").setLevel(logging.CRITICAL)

    def __exit__(self, *of: object) -> None:
        logging.getLogger("distributed").setLevel(self._level)
