# SPDX-License-Identifier: BSD-3-Clause
"""A discovery as an .rrd file: the waterfall, the rankings, predictions before and after, what was missing."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.tools.presentation.compared_models import of_discovery
from jointscope.tools.rerun_log.entities.columns import JOINT_COLOURS
from jointscope.tools.rerun_log.entities.diagnosis_documents import (
    diagnosis_markdown,
    discovery_markdown,
    ranking_markdown,
)
from jointscope.tools.rerun_log.entities.prediction_lines import prediction_bytes, prediction_views, send_predictions
from jointscope.tools.rerun_log.entities.rrd_file import rrd_file
from jointscope.tools.rerun_log.entities.tab_contents import document_view, send_document
from jointscope.tools.rerun_log.entities.tabbed_blueprint import tabbed_blueprint
from jointscope.tools.rerun_log.entities.torque_lines import send_torque, torque_bytes, torque_views
from jointscope.tools.rerun_log.entities.viewer_text import viewer_text

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

TRAINING, HELD_OUT = JOINT_COLOURS[2], JOINT_COLOURS[0]


def log_discovery(result: Discovery, path: str | Path) -> None:
    """Writes the file; it opens with the waterfall.

    Args:
        result: what the discovery found.
        path: file to write; an existing one is replaced.

    Raises:
        JointscopeError: the file cannot be written; nothing is left behind.
    """
    compared, diagnoses = of_discovery(result), _diagnoses(result)
    expected = prediction_bytes(compared) + sum(torque_bytes(d.missing) for d in diagnoses.values())
    with rrd_file(path, _blueprint(result), expected) as stream:
        send_document(stream, "waterfall/text", discovery_markdown(result))
        _send_bars(stream, result)
        for k, diagnosis in diagnoses.items():
            send_document(stream, f"step{k}/findings", diagnosis_markdown(diagnosis))
            send_document(stream, f"step{k}/ranking", ranking_markdown(diagnosis))
            if diagnosis.missing is not None:
                send_torque(stream, diagnosis.missing, f"step{k}")
        send_predictions(stream, compared)


def _diagnoses(result: Discovery) -> dict[int, Diagnosis]:
    return {k: step.diagnosis for k, step in enumerate(result.steps) if step.diagnosis is not None}


def _send_bars(stream: rr.RecordingStream, result: Discovery) -> None:
    """Two bars per step: training recordings, held-out recording."""
    import rerun as rr

    steps = range(len(result.steps))
    for name, offset, colour in (("train_error", 0.0, TRAINING), ("heldout_error", 0.4, HELD_OUT)):
        errors = [getattr(step, name) for step in result.steps]
        if all(map(math.isfinite, errors)):
            bars = rr.BarChart(errors, color=colour, abscissa=[k + offset for k in steps], widths=[0.38] * len(errors))
            stream.log(f"waterfall/bars/{name}", bars, static=True)


def _blueprint(result: Discovery) -> rrb.Blueprint:
    import rerun.blueprint as rrb

    waterfall = rrb.Horizontal(
        rrb.TextDocumentView(origin="/waterfall/text", name="what was found"),
        rrb.BarChartView(origin="/waterfall/bars", name="error by step [sigma]: blue training, orange held out"),
        column_shares=[3, 2],
        name="waterfall",
    )
    tabs: list[rrb.View | rrb.Container] = [waterfall]
    for k, diagnosis in _diagnoses(result).items():
        own: list[rrb.View | rrb.Container] = [
            document_view(f"step{k}/ranking"),
            document_view(f"step{k}/findings"),
        ]
        if diagnosis.missing is not None:
            own += torque_views(diagnosis.missing, f"step{k}", "")
        tabs.append(rrb.Tabs(*own, name=viewer_text(f"step {k}: {result.steps[k].label}"), active_tab=0))
    tabs += prediction_views(of_discovery(result))
    return tabbed_blueprint(tabs)
