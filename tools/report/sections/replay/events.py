# SPDX-License-Identifier: BSD-3-Clause
"""What happened: events in order, and what became of every message."""

from __future__ import annotations

from collections import Counter
from html import escape

from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult
from jointscope.tools.report.page.page import Section, foldable, table

SHOWN = 25
COUNTED = ("late", "duplicate")  # too many to be told one by one


def messages(result: ReplayResult) -> Section:
    """Received, used, late and dropped messages by stream."""
    status = result.status
    kinds = sorted({kind for dropped in status.dropped.values() for kind in dropped})
    rows = [
        [
            f"<code>{escape(name)}</code>",
            str(count),
            str(status.used.get(name, 0)),
            str(status.late.get(name, 0)),
            *(str(status.dropped.get(name, Counter()).get(kind, 0)) for kind in kinds),
        ]
        for name, count in status.received.items()
    ]
    head = ["stream", "received", "used", "of these late", *(kind.replace("_", " ") for kind in kinds)]
    body = table(head, rows, list(range(1, len(head))))
    lead = "Messages in the order of their arrival. Late ones inside the window are put where they were taken."
    return Section("messages", "What became of the messages", body, lead)


def events(result: ReplayResult) -> Section:
    """Counts by kind, then the events one by one."""
    lead = "What the estimator met: lost and returning streams, outliers, alarms."
    if not result.event_counts:
        return Section("events", "Events", "<p>Nothing happened.</p>", lead)
    counts = [[escape(kind.replace("_", " ")), str(count)] for kind, count in result.event_counts.items()]
    told = [event for event in result.events if event.kind not in COUNTED]
    rows = [
        [f"{event.time:.3f}", escape(event.kind.replace("_", " ")), escape(event.source), escape(event.text)]
        for event in told
    ]
    head = ["time [s]", "what", "where", "in words"]
    body = table(["event", "number"], counts, [1])
    body += table(head, rows[:SHOWN], [0]) if rows else ""
    if len(rows) > SHOWN:
        body += foldable(f"{len(rows) - SHOWN} more events", table(head, rows[SHOWN:], [0]))
    return Section("events", "Events", body, lead)
