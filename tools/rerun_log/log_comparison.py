# SPDX-License-Identifier: BSD-3-Clause
"""A comparison as an .rrd file: scores, errors in sigmas, predictions 0.1 s ahead and open loop."""

from __future__ import annotations

from pathlib import Path

from jointscope.graphs.comparison.comparison_result import ComparisonResult
from jointscope.tools.presentation.numbers import percent, significant
from jointscope.tools.rerun_log.entities.prediction_lines import prediction_bytes, prediction_views, send_predictions
from jointscope.tools.rerun_log.entities.rrd_file import rrd_file
from jointscope.tools.rerun_log.entities.tab_contents import document_view, send_document
from jointscope.tools.rerun_log.entities.tabbed_blueprint import tabbed_blueprint


def log_comparison(result: ComparisonResult, path: str | Path) -> None:
    """Writes the file; one tab per kind of prediction, one plot per channel, one colour per model.

    Args:
        result: what the comparison found.
        path: file to write; an existing one is replaced.

    Raises:
        JointscopeError: the file cannot be written; nothing is left behind.
    """
    blueprint = tabbed_blueprint([document_view("scores"), *prediction_views(result)])
    with rrd_file(path, blueprint, prediction_bytes(result)) as stream:
        send_document(stream, "scores", scores_text(result))
        send_predictions(stream, result)


def scores_text(result: ComparisonResult) -> str:
    """Error and floor of every model and the worst windows as markdown."""
    lines = ["# Error 0.1 s ahead, in sigmas of the sensor", "", "| model | error | floor |", "| --- | ---: | ---: |"]
    lines += [f"| {m.label} | **{significant(m.error)}** | {significant(m.floor)} |" for m in result.models]
    for model in result.models:
        lines += ["", f"## Worst windows of {model.label}", ""]
        lines += [
            f"- {w.channel}, {w.t0:.2f} to {w.t1:.2f} s: {percent(w.share)} of the squared error"
            for w in model.worst[:6]
        ]
    return "\n".join(lines)
