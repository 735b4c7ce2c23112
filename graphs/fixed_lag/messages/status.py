# SPDX-License-Identifier: BSD-3-Clause
"""What the estimator has received, used, dropped and why; how well it fits."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass, field

from jointscope.graphs.fixed_lag.messages.event import Event

EVENTS_KEPT = 1000
QUIET = 1.0  # [s] between two events of a kind that is frequent
FREQUENT = ("late", "too_late", "too_early", "duplicate", "not_finite", "incomplete", "stuck", "outlier")


@dataclass
class EstimatorStatus:
    """Counters and findings.

    Attributes:
        running: whether there is a state; False before the first samples.
        updates: ticks so far.
        restarts: how often the estimator began anew.
        received, used: samples by stream.
        late: samples that were used although later ones had come before, by stream.
        dropped: samples that were not used, by stream and kind (too_late, too_early, duplicate, not_finite,
            incomplete, stuck, outlier).
        nis: mean normalised innovation squared of the last second by channel, 1 is right.
        nis_mean: the same for all sensors together, per degree of freedom.
        alarms: channels whose innovations are larger than noise and model allow; `jointscope diagnose` says why.
        lost: streams from which nothing has come for long.
    """

    running: bool = False
    updates: int = 0
    restarts: int = 0
    received: Counter[str] = field(default_factory=Counter)
    used: Counter[str] = field(default_factory=Counter)
    late: Counter[str] = field(default_factory=Counter)
    dropped: dict[str, Counter[str]] = field(default_factory=dict)
    nis: dict[str, float] = field(default_factory=dict)
    nis_mean: float = float("nan")
    alarms: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()

    def drop(self, stream: str, kind: str, count: int = 1) -> None:
        """Counts samples that are not used."""
        self.dropped.setdefault(stream, Counter())[kind] += count


class EventLog:
    """The last events; frequent kinds are told once a second for each source."""

    def __init__(self) -> None:
        self.events: deque[Event] = deque(maxlen=EVENTS_KEPT)
        self._told: dict[tuple[str, str], float] = {}

    def tell(self, time: float, kind: str, source: str, text: str) -> None:
        """Adds an event."""
        if kind in FREQUENT:
            if abs(time - self._told.get((kind, source), float("-inf"))) < QUIET:
                return
            self._told[kind, source] = time
        self.events.append(Event(time, kind, source, text))
