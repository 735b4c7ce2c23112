# SPDX-License-Identifier: BSD-3-Clause
"""From what and with what these results were made."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from html import escape
from types import MappingProxyType
from typing import Any

import jointscope
from jointscope.graphs.fixed_lag.replay.replay_result import ReplaySource
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.page import Section
from jointscope.tools.writing.origin import recordings_of


def provenance(
    recordings: Sequence[Recording | ReplaySource],
    robots: list[Robot],
    seconds: float | None = None,
    made: Mapping[str, Any] = MappingProxyType({}),
) -> Section:
    """Recordings with their hashes, robot files, versions, date; `made` is where rests beside motion stand."""
    entries: list[tuple[str, str]] = []
    for recording in recordings:
        begin = datetime.fromtimestamp(recording.start_ns / 1e9, UTC)
        entries.append(("recording", f"<code>{escape(recording.path)}</code>"))
        entries.append(("sha256", f"<code>{escape(recording.sha256) or '—'}</code>"))
        size = f"{significant(recording.duration, 4)} s, {recording.sample_count} messages"
        entries.append(("content", f"{size}, starts {begin:%Y-%m-%d %H:%M:%S} UTC"))
        if isinstance(recording, Recording) and recording.left_out:
            stretches = ", ".join(f"{t0:g} to {t1:g} s" for t0, t1 in recording.left_out)
            entries.append(("left out", stretches))
    entries += _used_beside(made)
    for robot in robots:
        choices = robot.choices
        text = f"integrator {choices.integrator}, Coriolis terms {'on' if choices.coriolis else 'off'}"
        entries.append(("robot", f"{escape(robot.name)}, <code>{escape(robot.path.name)}</code>, {escape(text)}"))
    return _section(entries, seconds)


def provenance_without_motion(made: Mapping[str, Any], robot: Robot) -> Section:
    """The same of results from poses, rests and frequency responses.

    Args:
        made: as the robot file has it.
        robot: what was found.
    """
    start = f"{escape(robot.name)}, started from <code>{escape(made['start'])}</code>"
    return _section([*_used_beside(made), ("robot", start)], None)


def _used_beside(made: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Recordings of other kinds than motion, with their hashes."""
    return [
        entry
        for each in recordings_of(made)
        if each["kind"] != "bags"
        for entry in (
            (each["kind"], f"<code>{escape(each['path'])}</code>"),
            ("sha256", f"<code>{escape(each['sha256']) or '—'}</code>"),
        )
    ]


def _section(entries: list[tuple[str, str]], seconds: float | None) -> Section:
    """With what is the same of all results."""
    if seconds is not None:
        entries.append(("calculated in", f"{significant(seconds)} s"))
    versions = f"jointscope {jointscope.__version__}, Python {platform.python_version()}"
    entries.append(("versions", escape(versions)))
    entries.append(("written", f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC"))
    body = "<dl>" + "".join(f"<dt>{escape(k)}</dt><dd>{v}</dd>" for k, v in entries) + "</dl>"
    return Section("provenance", "Provenance", body)
