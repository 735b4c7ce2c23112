# SPDX-License-Identifier: BSD-3-Clause
"""Known loads from a table beside a bag, `BAG.loads.csv`: what a person noted who hung weights on an arm.

Columns: `time`, in seconds since the recording began or as stamps since 1970; `link`, at whose origin the load hangs;
`mass` in kg, or `fx`, `fy`, `fz` in N and in the axes of the world. A row holds until the next one; one of no mass
takes all loads off.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.rests.load_history import LoadHistory
from jointscope.robots.yaml_section import did_you_mean
from jointscope.tools.bags.at_poses.table import Table

Array = NDArray[np.float64]

BAGS = (".bag", ".db3", ".mcap")
FORCE = ("fx", "fy", "fz")
EPOCH = 1e8  # [s] no recording is that long: larger times are stamps
HEAVY = 3.0  # times what the robot weighs: no arm holds that


def loads_beside(bag: Path) -> Path:
    """Where the table of a bag would be."""
    bag = bag.absolute()
    return bag.with_name(f"{bag.stem if bag.suffix in BAGS else bag.name}.loads.csv")


def loads_from_table(path: Path, robot: Robot, recording: Recording) -> LoadHistory:
    """The loads of a table on the clock of its recording.

    Raises:
        RecordingError: a column is missing, a cell is no number, times of another recording, or loads that cannot hang
            on this robot.
    """
    table = Table.read(path, "load")
    forces = _forces(table, robot)
    times = table.numbers([_column(table, "time")])[:, 0]
    if np.all(times > EPOCH):
        times = times - recording.start_ns / 1e9
    last = float(max(stream.times[-1] for stream in recording.streams.values()))
    outside = np.flatnonzero((times < 0.0) | (times > last))
    if len(outside):
        raise RecordingError(
            f"{path}: line {outside[0] + 2}: a load at {times[outside[0]]:.6g} s, but the recording lasts from 0 to "
            f"{last:.6g} s; expected seconds since it began, or stamps in seconds since 1970"
        )
    _column(table, "link")
    links = [link if np.any(force) else "" for link, force in zip(table.words("link"), forces, strict=True)]
    check_loads(str(path), robot, forces[[bool(np.any(f)) for f in forces]], [k for k in links if k], "column link")
    unnamed = next((i for i, (k, f) in enumerate(zip(links, forces, strict=True)) if np.any(f) and not k), None)
    if unnamed is not None:
        raise RecordingError(f"{path}: line {unnamed + 2}, column link: expected the link that the load hangs on")
    order = np.argsort(times, kind="stable")
    again = np.flatnonzero(np.diff(times[order]) == 0.0)
    if len(again):
        raise RecordingError(
            f"{path}: two loads at {times[order[again[0]]]:.6g} s; one holds until the next: give their sum"
        )
    return LoadHistory(times[order], forces[order], tuple(links[i] for i in order))


def _forces(table: Table, robot: Robot) -> Array:
    """Force of each row in the axes of the base, shape (k, 3) [N]."""
    both = [axis for axis in FORCE if axis in table.head] if "mass" in table.head else []
    if both:
        raise RecordingError(
            f"{table.path}: columns mass and {', '.join(both)} both say what hangs there; expected mass [kg] or fx, "
            "fy, fz [N]: leave out one of the two"
        )
    if "mass" in table.head:
        mass = table.numbers([table.head.index("mass")])
        if np.any(mass < 0.0):
            line = int(np.argmax(mass < 0.0)) + 2
            raise RecordingError(f"{table.path}: line {line}, column mass: expected kilograms, got {mass.min():g}")
        if mass.max() > HEAVY * (whole := _mass(robot)):
            line = int(np.argmax(mass)) + 2
            raise RecordingError(
                f"{table.path}: line {line}, column mass: {mass.max():.4g} kg on a robot of {whole:.3g} kg; expected "
                "kilograms: grams times 0.001"
            )
        return mass * robot.tree.gravity
    return table.numbers([_column(table, axis) for axis in FORCE])


def _column(table: Table, name: str) -> int:
    if name not in table.head:
        raise RecordingError(
            f"{table.path}: no column {name!r}; expected time, link, and mass [kg] or fx, fy, fz [N]; there are "
            f"{', '.join(table.head)}"
        )
    return table.head.index(name)


def check_loads(where: str, robot: Robot, forces: Array, links: Sequence[str], names: str) -> None:
    """Loads that can hang on a robot.

    Args:
        where: they stand, for messages.
        robot: that they hang on.
        forces: shape (k, 3) [N].
        links: that they act on.
        names: what names the link there.

    Raises:
        RecordingError: no numbers, links that are not there, weights in grams.
    """
    if not np.all(np.isfinite(forces)):
        raise RecordingError(f"{where}: a force is no number; remove these messages")
    for link in dict.fromkeys(links):
        if link not in robot.tree.bodies:
            hint = did_you_mean(link, robot.tree.bodies)
            raise RecordingError(
                f"{where}: no link {link!r} in {robot.tree.urdf.name}{hint}; "
                f"{names} names the link at whose origin the force acts"
            )
    weight = _mass(robot) * float(np.linalg.norm(robot.tree.gravity))
    largest = float(np.linalg.norm(forces, axis=1).max(initial=0.0))
    if 0.0 < HEAVY * weight < largest:
        raise RecordingError(
            f"{where}: a force of {largest:.4g} N on a robot that weighs {weight:.3g} N; expected newton: "
            "kilograms times 9.81, grams times 0.00981"
        )


def _mass(robot: Robot) -> float:
    """Of the whole robot [kg]."""
    return float(sum(inertia.mass for inertia in robot.tree.model.inertias))
