# SPDX-License-Identifier: BSD-3-Clause
"""What local processes and a cluster have in common: slots, each of which one worker fills at a time.

A worker may die. Whoever gave it something to keep is told by `WorkerLost`, and gives it to its successor again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

MOST_LOSSES = 4  # of one slot in a row; then it is not by chance that its workers die


class WorkerLost(Exception):
    """A worker ended before its result was there; the slot has another one now."""


class Pending(Protocol):
    """A result to come."""

    def result(self) -> Any:
        """Waits for it.

        Raises:
            WorkerLost: who should have brought it is gone, with all that it kept.
        """


class Crew(Protocol):
    """Workers in slots."""

    @property
    def slots(self) -> int:
        """How many functions run at once."""

    @property
    def name(self) -> str:
        """What the workers are called in messages."""

    @property
    def memories(self) -> list[tuple[float, list[int]]]:
        """Memory that is left [bytes] with the slots that share it."""

    def submit(self, slot: int, function: Callable[..., Any], *args: Any) -> Pending:
        """Begins function(*args) on the worker of a slot; the function stands in a module that workers have, too."""
