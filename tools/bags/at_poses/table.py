# SPDX-License-Identifier: BSD-3-Clause
"""Tables (CSV) that people write: a line with the names of the columns, then one line per row."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError

Array = NDArray[np.float64]
SEPARATORS = {";": "semicolons", "\t": "tabs"}


@dataclass(frozen=True)
class Table:
    """Cells as they stand in a file.

    Attributes:
        path: of the file.
        text: all of it.
        head: names of the columns.
        body: cells of each row; empty lines are left out.
    """

    path: Path
    text: str
    head: list[str]
    body: list[list[str]]

    @staticmethod
    def read(path: Path, row: str) -> Table:
        """Reads a file.

        Args:
            path: of the file.
            row: what a row is about, for the message where there is none.

        Raises:
            RecordingError: it cannot be read, is no text, or has rows of other lengths.
        """
        text = _text(path)
        rows = list(csv.reader(text.splitlines()))
        if len(rows) < 2:
            raise RecordingError(
                f"{path}: expected a line with the names of the columns and one per {row}, got {len(rows)} lines"
            )
        apart = next((name for mark, name in SEPARATORS.items() if len(rows[0]) == 1 and mark in rows[0][0]), None)
        if apart:
            raise RecordingError(
                f"{path}: {apart} stand between the cells; expected commas, and points in numbers: export it as such"
            )
        head, body = [cell.strip() for cell in rows[0]], [line for line in rows[1:] if any(c.strip() for c in line)]
        wrong = next((i for i, line in enumerate(body) if len(line) != len(head)), None)
        if wrong is not None:
            raise RecordingError(
                f"{path}: line {wrong + 2} has {len(body[wrong])} cells, the first line {len(head)}; expected as many, "
                "and points in numbers, not commas"
            )
        return Table(path, text, head, body)

    def numbers(self, columns: Sequence[int]) -> Array:
        """The cells of some columns, shape (rows, columns).

        Raises:
            RecordingError: a cell is no finite number.
        """
        found = np.empty((len(self.body), len(columns)))
        for i, row in enumerate(self.body):
            for k, column in enumerate(columns):
                try:
                    found[i, k] = float(row[column])
                except ValueError:
                    raise RecordingError(
                        f"{self.path}: line {i + 2}, column {self.head[column]}: expected a number, got {row[column]!r}"
                    ) from None
        if not np.all(np.isfinite(found)):
            i, k = np.argwhere(~np.isfinite(found))[0]
            where = f"{self.path}: line {i + 2}, column {self.head[columns[k]]}"
            raise RecordingError(f"{where}: expected a finite number, got {found[i, k]}")
        return found

    def words(self, column: str) -> list[str]:
        """The cells of a column."""
        place = self.head.index(column)
        return [row[place].strip() for row in self.body]


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as err:
        raise RecordingError(f"cannot read {path}: {err.strerror or err}") from err
    except UnicodeDecodeError as err:
        raise RecordingError(f"{path} is no table: it is not text") from err
