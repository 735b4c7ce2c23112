# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis as an .rrd file: the answer, the ranking, the missing torque over time and its shape, predictions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.tools.presentation.compared_models import of_diagnosis
from jointscope.tools.rerun_log.entities.diagnosis_documents import diagnosis_markdown, ranking_markdown
from jointscope.tools.rerun_log.entities.prediction_lines import prediction_bytes, prediction_views, send_predictions
from jointscope.tools.rerun_log.entities.rrd_file import rrd_file
from jointscope.tools.rerun_log.entities.tab_contents import document_view, send_document
from jointscope.tools.rerun_log.entities.tabbed_blueprint import tabbed_blueprint
from jointscope.tools.rerun_log.entities.torque_lines import send_torque, torque_bytes, torque_views

if TYPE_CHECKING:
    import rerun.blueprint as rrb


def log_diagnosis(result: Diagnosis, path: str | Path) -> None:
    """Writes the file; it opens with the answer.

    Args:
        result: what the diagnosis found.
        path: file to write; an existing one is replaced.

    Raises:
        JointscopeError: the file cannot be written; nothing is left behind.
    """
    compared = of_diagnosis(result)
    expected = torque_bytes(result.missing) + (prediction_bytes(compared) if compared else 0)
    with rrd_file(path, _blueprint(result), expected) as stream:
        send_document(stream, "findings", diagnosis_markdown(result))
        send_document(stream, "ranking", ranking_markdown(result))
        if result.missing is not None:
            send_torque(stream, result.missing, "")
        if compared is not None:
            send_predictions(stream, compared)


def _blueprint(result: Diagnosis) -> rrb.Blueprint:
    tabs: list[rrb.View | rrb.Container] = [document_view("findings"), document_view("ranking")]
    if result.missing is not None:
        tabs += torque_views(result.missing, "", "")
    compared = of_diagnosis(result)
    if compared is not None:
        tabs += prediction_views(compared)
    return tabbed_blueprint(tabs)
