# SPDX-License-Identifier: BSD-3-Clause
"""What tabs hold: texts, plots of curves over time, and columns of plots."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import repeat
from typing import TYPE_CHECKING

from jointscope.tools.rerun_log.entities.viewer_text import entity, viewer_text

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb


def send_document(stream: rr.RecordingStream, path: str, markdown: str) -> None:
    """A text with letters that the viewer has."""
    import rerun as rr

    stream.log(path, rr.TextDocument(viewer_text(markdown), media_type=rr.MediaType.MARKDOWN), static=True)


def document_view(path: str) -> rrb.TextDocumentView:
    """The text, named as the last part of its path."""
    import rerun.blueprint as rrb

    return rrb.TextDocumentView(origin=f"/{path}", name=path.rpartition("/")[2])


def plot_view(
    title: str, *path: str, legend: bool | None = None, reach: tuple[float, float] | None = None
) -> rrb.TimeSeriesView:
    """All curves below an entity.

    Args:
        title: what is shown, and its unit.
        path: of the entity, names that may contain anything.
        legend: whether the curves are named; None leaves it to the viewer.
        reach: limits of the axis; None leaves them to the viewer.
    """
    import rerun.blueprint as rrb

    return rrb.TimeSeriesView(
        origin="/" + entity(*path),
        name=viewer_text(title),
        plot_legend=None if legend is None else rrb.PlotLegend(visible=legend),
        axis_y=None if reach is None else rrb.ScalarAxis(range=reach),
    )


def plot_columns(
    columns: Iterable[Iterable[rrb.View]], name: str | None = None, heads: Sequence[str] = ()
) -> rrb.Horizontal:
    """Columns of plots side by side, with heads or without."""
    import rerun.blueprint as rrb

    titles = map(viewer_text, heads) if heads else repeat(None)
    return rrb.Horizontal(*(rrb.Vertical(*c, name=title) for c, title in zip(columns, titles, strict=False)), name=name)
