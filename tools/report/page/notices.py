# SPDX-License-Identifier: BSD-3-Clause
"""What the reader did to the data: dropped, repaired, or found odd."""

from __future__ import annotations

from html import escape

from jointscope.robots.recordings.recording import Recording
from jointscope.tools.report.page.page import Section, table


def notices(recordings: list[Recording]) -> Section:
    """One row per notice of each recording."""
    rows = [
        [
            *([f"<code>{escape(recording.path)}</code>"] if len(recordings) > 1 else []),
            escape(notice.stream),
            escape(notice.kind.replace("_", " ")),
            str(notice.count),
            escape(notice.text),
        ]
        for recording in recordings
        for notice in recording.notices
    ]
    head = [*(["recording"] if len(recordings) > 1 else []), "stream", "what", "samples", "in words"]
    body = table(head, rows, [head.index("samples")]) if rows else "<p>Nothing: every sample was used as it came.</p>"
    return Section("notices", "What the reader noticed", body)
