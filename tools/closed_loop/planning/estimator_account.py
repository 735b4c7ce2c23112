# SPDX-License-Identifier: BSD-3-Clause
"""What an estimator says of itself after a run: time per tick, alarms, losses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class EstimatorAccount:
    """One run in the loop.

    Attributes:
        update_ms: wall time per tick, {"p50", "p99", "max"} [ms].
        alarms: channels whose innovations were larger than noise and model allow at some time.
        dropped: samples that were not used, by stream and kind.
        restarts: how often it began anew.
    """

    update_ms: dict[str, float]
    alarms: tuple[str, ...]
    dropped: dict[str, dict[str, int]]
    restarts: int

    @classmethod
    def of(cls, seconds: Sequence[float], events: Sequence[Any], status: Any) -> EstimatorAccount:
        """From wall times per tick [s], and from the estimator's events and status."""
        milliseconds = 1e3 * np.array(seconds)
        p50, p99 = np.percentile(milliseconds, [50.0, 99.0])
        alarms = sorted({event.source for event in events if event.kind == "alarm"})
        dropped: Mapping[str, Mapping[str, int]] = status.dropped
        return cls(
            {"p50": float(p50), "p99": float(p99), "max": float(milliseconds.max())},
            tuple(alarms),
            {stream: dict(kinds) for stream, kinds in dropped.items()},
            int(status.restarts),
        )
