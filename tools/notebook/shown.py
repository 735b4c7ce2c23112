# SPDX-License-Identifier: BSD-3-Clause
"""A result that shows itself: text and table in a notebook, a data frame, a figure, and the files of the verbs."""

from __future__ import annotations

import importlib
from abc import ABC, abstractmethod
from collections.abc import Sequence
from html import escape
from itertools import accumulate
from pathlib import Path
from typing import Any

from jointscope.graphs.across_kinds.discover_kinds import KindsDiscovery
from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.comparison.comparison_result import ComparisonResult
from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult
from jointscope.robots.errors import JointscopeError
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.terminal.text_table import text_table
from jointscope.tools.verb_parts.result_files import ResultFiles
from jointscope.tools.writing.protected_files import check_robot_files
from jointscope.tools.writing.whole_file import check_outputs

Row = dict[str, Any]
SHOWN_ROWS = 40  # in a notebook or on a screen; the data frame has all
SHOWN_WIDTH = 160  # characters of a printed line


class Shown(ABC):
    """What all results can do."""

    @abstractmethod
    def answer(self) -> str:
        """What was found: a sentence, and where there are doubts a line for each below it."""

    @abstractmethod
    def rows(self) -> list[Row]:
        """The numbers as records of one shape, in SI units."""

    @abstractmethod
    def draw(self, axes: Any) -> None:
        """Draws the result into matplotlib's axes."""

    @abstractmethod
    def write(self, files: ResultFiles) -> None:
        """Writes the files of the verb."""

    def to_dataframe(self) -> Any:
        """The numbers as a pandas.DataFrame.

        Raises:
            JointscopeError: pandas is not installed.
        """
        return _outside("pandas", "to_dataframe()", "pip install pandas").DataFrame(self.rows())

    def plot(self, axes: Any = None) -> Any:
        """The result as a figure of matplotlib; needs no display.

        Args:
            axes: where to draw; a figure of its own if not given.

        Returns:
            The matplotlib.figure.Figure: a notebook shows it, `savefig` writes it.

        Raises:
            JointscopeError: matplotlib is not installed.
        """
        pyplot = _outside("matplotlib.pyplot", "plot()", "pip install 'jointscope[plot]'")
        if axes is None:
            figure, axes = pyplot.subplots(figsize=(9.0, 4.0), layout="constrained")
            pyplot.close(figure)  # a notebook shows what is returned, not that and the open figure
        self.draw(axes)
        axes.set_title(self.answer().splitlines()[0], wrap=True)
        return axes.figure

    def save(
        self,
        robot: str | Path | None = None,
        *,
        report: str | Path | None = None,
        rrd: str | Path | None = None,
        json: str | Path | None = None,
        figures: str | Path | None = None,
    ) -> None:
        """Writes what the verbs write: all files, or none.

        Args:
            robot: robot file, of results that have a robot.
            report: HTML.
            rrd: recording for the viewer.
            json: what the screen says.
            figures: folder for the pictures of the report.

        Raises:
            JointscopeError: a file cannot be written.
        """
        files = ResultFiles(*(None if path is None else Path(path) for path in (report, rrd, json, robot, figures)))
        check_outputs(files.all, inputs=_recorded_files(self))
        named = {"output": files.robot, "report": files.report, "rrd": files.rrd, "json": files.json}
        check_robot_files(named, _robot_files(self))
        self.write(files)

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        rows = self.rows()
        head = "".join(f"<th>{escape(name)}</th>" for name in rows[0]) if rows else ""
        lines = "".join(f"<tr>{''.join(map(_cell, row.values()))}</tr>" for row in rows[:SHOWN_ROWS])
        more = f"<p>{len(rows) - SHOWN_ROWS} more</p>" if len(rows) > SHOWN_ROWS else ""
        first, *doubts = map(escape, self.answer().splitlines())
        told = f"<b>{first}</b>{''.join(f'<br>{doubt}' for doubt in doubts)}"
        return f"<p>{told}</p><table><tr>{head}</tr>{lines}</table>{more}"

    def __repr__(self) -> str:
        """What `print` and an interactive Python show: the answer, and a table of the numbers."""
        return f"{self.answer()}\n\n{_plain_table(self.rows())}".rstrip()


def _text(value: Any) -> str:
    return significant(value, 5) if isinstance(value, float) else "" if value is None else str(value)


def _cell(value: Any) -> str:
    return f"<td>{escape(_text(value))}</td>"


def _plain_table(rows: Sequence[Row]) -> str:
    """The first rows, with the columns that a screen has room for, and a line that says what is left."""
    if not rows:
        return ""
    shown = rows[:SHOWN_ROWS]
    cells = {name: [_text(row[name]) for row in shown] for name in rows[0]}
    ends = accumulate(2 + max(map(len, (name, *texts))) for name, texts in cells.items())
    names = [name for k, (name, end) in enumerate(zip(cells, ends, strict=True)) if end <= SHOWN_WIDTH or k == 0]
    align = "".join(">" if any(isinstance(row[name], float) for row in shown) else "<" for name in names)
    table = text_table(names, list(zip(*(cells[name] for name in names), strict=True)), align)
    left = [(len(rows) - len(shown), "rows"), (len(cells) - len(names), "columns")]
    more = " and ".join(f"{count} more {what}" for count, what in left if count)
    return f"{table}\n  ({more}: rows(), to_dataframe())" if more else table


def _outside(module: str, method: str, way: str) -> Any:
    """A module that comes with no installation of this package by itself."""
    try:
        return importlib.import_module(module)
    except ImportError as err:
        raise JointscopeError(f"{method} needs {module.partition('.')[0]}, which is not installed; do: {way}") from err


def _recorded_files(found: Any) -> list[str]:
    """Paths of its recordings; of those that are no file, none."""
    if isinstance(found, CalibrationResult):
        paths = [bag.recording.path for bag in found.bags]
    elif isinstance(found, ComparisonResult):
        paths = [found.recording.path]
    elif isinstance(found, Diagnosis | Discovery):
        paths = [recording.path for recording in (*found.recordings, found.heldout) if recording is not None]
    elif isinstance(getattr(found, "given", None), KindsRecordings):
        paths = [*found.given.paths, *found.held.paths]
    else:
        paths = [found.source.path] if isinstance(found, ReplayResult) else []
    return [path for path in paths if path]


def _robot_files(found: Any) -> list[Path]:
    """Files of the robots that it began with."""
    if isinstance(found, CalibrationResult):
        return [found.start.path]
    if isinstance(found, ComparisonResult):
        return [model.robot.path for model in found.models]
    if isinstance(found, Discovery):
        return [found.steps[0].robot.path]
    if isinstance(found, KindsDiscovery):
        return [found.steps[0].model.robot.path]
    return [found.robot.path] if isinstance(found, Diagnosis | ReplayResult) else []
