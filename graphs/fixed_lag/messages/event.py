# SPDX-License-Identifier: BSD-3-Clause
"""One thing that happened to the estimator and that its user should know."""

from __future__ import annotations

from dataclasses import dataclass

KINDS = (
    "started",
    "late",
    "too_late",
    "too_early",
    "duplicate",
    "not_finite",
    "incomplete",
    "stuck",
    "outlier",
    "sensor_lost",
    "sensor_back",
    "command_lost",
    "command_back",
    "alarm",
    "alarm_over",
    "restarted",
)


@dataclass(frozen=True)
class Event:
    """An event; frequent ones (late, too_late, duplicate, not_finite, outlier) are told once a second per stream.

    Attributes:
        time: stamp at which it happened [s].
        kind: one of KINDS.
        source: the stream or channel concerned.
        text: one sentence.
    """

    time: float
    kind: str
    source: str
    text: str
