# SPDX-License-Identifier: BSD-3-Clause
"""Where the recordings of real robots lie, and the waterfall of a search in them as a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from tables import Table

from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.bags.read_recording import read_recording

REAL = Path(__file__).resolve().parents[1].parent / "shared" / "data" / "real"
MILLI = 1e3


def recording(robot: Robot, path: str) -> Recording:
    """A recording by its path below `REAL`."""
    return read_recording(REAL / path, robot)


def halves(whole: Recording, share: float) -> tuple[Recording, Recording]:
    """The first part and the rest of a recording."""
    cut = share * whole.duration + min(float(stream.times[0]) for stream in whole.streams.values())
    return whole.between(float("-inf"), cut), whole.between(cut, float("inf"))


def left(result: Discovery, name: str, step: int) -> float:
    """What a step leaves of an equation on the held-out recording, rms over its channels [SI]."""
    channels = result.steps[step].comparison.channels.items()
    return float(np.sqrt(np.mean([c.horizons["0.1"] ** 2 for channel, c in channels if _equation(channel) == name])))


def waterfall(title: str, result: Discovery) -> Table:
    """Held-out errors of every equation, step by step."""
    units = {_equation(channel): c.unit for channel, c in result.steps[0].comparison.channels.items()}
    rows = []
    for k, step in enumerate(result.steps):
        cells = [f"{MILLI * left(result, name, k):.3g}" for name in units]
        rows.append((str(k), step.label, *cells))
    head = ("step", "added", *(f"{name} [m{unit}]" for name, unit in units.items()))
    return Table(title, head, rows)


def _equation(channel: str) -> str:
    """Channels of a gyro are one equation."""
    return channel if channel.endswith(".gear") else channel.rsplit(".", 1)[0]
