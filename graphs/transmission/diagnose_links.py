# SPDX-License-Identifier: BSD-3-Clause
"""Which effect a robot with free links lacks: calibrate, judge what could show, say where that leaves the model."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from jointscope.graphs.calibration.failures_with_notices import names_notices
from jointscope.graphs.comparison.comparison_result import SENSOR_NOISE, ModelComparison
from jointscope.graphs.comparison.failure_analysis import FailureAnalysis
from jointscope.graphs.discovery.diagnose import ADEQUATE
from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.graphs.discovery.diagnosis_words import paragraphs_of
from jointscope.graphs.discovery.unexplained import unexplained_share
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.graphs.transmission.compare_links import compare_links_model
from jointscope.graphs.transmission.links_model import LinksModel
from jointscope.graphs.transmission.what_may_be_added import Additions, total
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording


@in_solver_context
@names_notices
def diagnose_links(
    robot: Robot,
    recordings: Sequence[Recording],
    holdout: Recording | None = None,
    *,
    base: LinksModel | None = None,
    comparison: ModelComparison | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Ranks the effects that a robot with free links lacks; arguments, result and errors as of `diagnose`."""
    began, report = time.perf_counter(), progress or (lambda text, share: None)
    report("calibrating the base model", 0.0)
    base = base or LinksModel.of(robot, recordings)
    comparison = comparison or compare_links_model("base", base.robot, holdout or base.recordings[0])
    report("scoring the catalogue", 0.5)
    additions = Additions.of(base)
    candidates, refits = additions.candidates()
    best = next((c for c in candidates if c.verdict == "missing"), None)
    error = total(additions.before)
    share = unexplained_share(error if best is None else best.validation_error, SENSOR_NOISE)
    found = Diagnosis(
        robot=base.robot,
        candidates=tuple(candidates),
        adequate=best is None and share < ADEQUATE,
        unexplained_share=share,
        error=comparison.judged_error,
        floor=comparison.judged_floor,
        validation_error=error,
        failure=FailureAnalysis({}, {}, ()),
        missing=None,
        noise_levels={},
        placebo_score=float("nan"),
        paragraphs=(),
        refits=refits,
        comparison=comparison,
        wall_seconds={"all": time.perf_counter() - began},
        recordings=base.recordings,
        heldout=holdout,
    )
    told = tuple(f"{c.label} {c.reasons[0]}." for c in candidates if c.verdict == "missing")
    return replace(found, paragraphs=(*paragraphs_of(found), *told))
