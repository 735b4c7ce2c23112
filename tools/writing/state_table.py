# SPDX-License-Identifier: BSD-3-Clause
"""Estimated states as a table, one row per tick, written while the replay runs: .parquet or .csv.

Columns: time [s]; age of the newest sample [s]; every state and its sigma; biases; adapted parameters; then the
smoothed state at the lag with its own time. Units are SI. What is not known is NaN: the lagged state until the window
is full, and where it was not read (every twentieth row, if not told otherwise, as it costs more than an update).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.estimated_state import EstimatedState
from jointscope.graphs.fixed_lag.messages.event import Event
from jointscope.graphs.fixed_lag.tick import Tick
from jointscope.graphs.fixed_lag.window.state_names import state_names
from jointscope.robots.errors import JointscopeError
from jointscope.robots.model.robot import Robot
from jointscope.tools.writing.whole_file import whole_file

SUFFIXES = (".parquet", ".csv")
ROWS = 8192  # written at once
AXES = ("x", "y", "z")


def check_table_name(path: Path) -> None:
    """Refuses a file name whose suffix says no known format.

    Raises:
        JointscopeError: it does not end in .parquet or .csv.
    """
    if path.suffix not in SUFFIXES:
        raise JointscopeError(
            f"cannot write {path}: expected a name that ends in .parquet or .csv, got {path.suffix!r}"
        )


@contextmanager
def state_table(path: Path, robot: Robot, adapted: tuple[str, ...] = ()) -> Iterator[StateTable]:
    """A table to which ticks are added, complete after `finish`; the file appears when the block ends well.

    Args:
        path: ends in .parquet or .csv.
        robot: the model.
        adapted: names of the adapted parameters.

    Raises:
        JointscopeError: the file cannot be written; nothing is left behind.
    """
    check_table_name(path)
    with whole_file(path) as unfinished:
        table = StateTable(unfinished, robot, adapted)
        try:
            yield table
        finally:
            table.close()


class StateTable:
    """Collects rows and writes them in pieces.

    Attributes:
        columns: names of the columns.
    """

    def __init__(self, path: Path, robot: Robot, adapted: tuple[str, ...]):
        import pyarrow as pa  # comes with the viewer's package
        import pyarrow.csv
        import pyarrow.parquet

        self._biased = tuple(sensor.name for sensor in robot.biased)
        self._adapted = adapted
        one = _columns(robot, self._biased, adapted)
        self.columns = ("time", "age", *one, "lagged.time", *(f"lagged.{name}" for name in one))
        self._half = len(one)
        self._rows = np.empty((ROWS, len(self.columns)))
        self._count = 0
        self._closed = False
        self._schema = pa.schema([(name, pa.float64()) for name in self.columns])
        is_csv = path.suffix == ".csv"
        self._writer: Any = (
            pa.csv.CSVWriter(path, self._schema) if is_csv else pa.parquet.ParquetWriter(path, self._schema)
        )

    def add(self, tick: Tick, lagged: EstimatedState | None, events: tuple[Event, ...] = ()) -> None:
        """Adds the row of a tick; events are not part of the table."""
        row = self._rows[self._count]
        row[:2] = tick.state.time, tick.state.age
        self._fill(row[2 : 2 + self._half], tick.state)
        if lagged is None:
            row[2 + self._half :] = np.nan
        else:
            row[2 + self._half] = lagged.time
            self._fill(row[3 + self._half :], lagged)
        self._count += 1
        if self._count == len(self._rows):
            self._flush()

    def finish(self) -> None:
        """Writes the last rows and ends the file."""
        self._flush()
        self.close()

    def _flush(self) -> None:
        """Writes the rows that were collected."""
        import pyarrow as pa

        rows = self._rows[: self._count]
        arrays = [pa.array(np.ascontiguousarray(column)) for column in rows.T]
        self._writer.write_table(pa.Table.from_arrays(arrays, schema=self._schema))
        self._count = 0

    def close(self) -> None:
        """Ends the file, complete or not."""
        if not self._closed:
            self._closed = True
            self._writer.close()

    def _fill(self, part: NDArray[np.float64], state: EstimatedState) -> None:
        d = len(state.mean)
        part[:d], part[d : 2 * d] = state.mean, state.sigma
        at = 2 * d
        for name in self._biased:
            part[at : at + 3] = state.biases.get(name, np.nan)
            part[at + 3 : at + 6] = state.bias_sigmas.get(name, np.nan)
            at += 6
        for name in self._adapted:
            part[at : at + 2] = state.parameters.get(name, np.nan)
            at += 2


def _columns(robot: Robot, biased: tuple[str, ...], adapted: tuple[str, ...]) -> list[str]:
    """Names of what is told about one state."""
    names = state_names(robot.layout)
    columns = [*names, *(f"{name}.sigma" for name in names)]
    for sensor in biased:
        columns += [f"{sensor}.bias.{axis}" for axis in AXES] + [f"{sensor}.bias.{axis}.sigma" for axis in AXES]
    for name in adapted:
        columns += [name, f"{name}.sigma"]
    return columns
