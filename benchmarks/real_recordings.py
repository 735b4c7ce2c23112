# SPDX-License-Identifier: BSD-3-Clause
"""Where the recordings of real robots lie, and the waterfall of a search in them as a table."""

from __future__ import annotations

from pathlib import Path

from tables import Table

from jointscope.graphs.transmission.transmission_result import TransmissionDiscovery
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


def left(result: TransmissionDiscovery, name: str, step: int) -> float:
    """What a step leaves of an equation on the held-out recording, rms [SI]."""
    return result.steps[step].heldout[name] * result.units()[name][0]


def waterfall(title: str, result: TransmissionDiscovery) -> Table:
    """Held-out errors of every equation, step by step."""
    units = result.units()
    rows = []
    for k, step in enumerate(result.steps):
        cells = [f"{MILLI * left(result, name, k):.3g}" for name in units]
        rows.append((str(k), step.added or "base model", *cells))
    head = ("step", "added", *(f"{name} [m{unit}]" for name, (_, unit) in units.items()))
    return Table(title, head, rows)
