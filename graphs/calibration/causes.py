# SPDX-License-Identifier: BSD-3-Clause
"""What a calibration asks of its residuals: what is late, which masses are wrong, which effects are lacking."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.calibration.encoder_filters import lacking_filter
from jointscope.graphs.calibration.stages.solved import Solved
from jointscope.graphs.calibration.stages.solved_windows import tested_on_windows
from jointscope.graphs.calibration.stages.whole_stage import WholeStage
from jointscope.graphs.problem.step_errors import inertia_shifts
from jointscope.graphs.scoring.drive_timing import drive_timing
from jointscope.graphs.scoring.lacking_effects import Suspects, lacking_effects
from jointscope.graphs.scoring.regression.asked_by_regression import asked_by_regression
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.graphs.scoring.torque_readings import torque_readings
from jointscope.graphs.scoring.wrong_masses import wrong_masses
from jointscope.graphs.solving.solver_context import give_back_memory
from jointscope.robots.recordings.recording import Recording


def asked_for_causes(
    result: CalibrationResult, solved: Solved, stage: WholeStage | None, recordings: Sequence[Recording]
) -> CalibrationResult:
    """With what a linear step says of late signals, of masses and, with a stage to try more, of the whole catalogue."""
    suspects = _suspects(solved) if stage else None
    give_back_memory()  # that of windows, before all samples need as much
    test = ScoreTest.of(*solved.of_motions, solved.eliminations)
    lacking = lacking_effects(test, suspects) if suspects is not None else ()
    smoothed = lacking_filter(stage, solved) if stage else None
    if smoothed is not None and smoothed.moved(result.found):
        lacking = (smoothed, *(other for other in lacking if other.effect != smoothed.effect))
    shifts: dict[str, float] = {}
    for motion in zip(*solved.of_motions, strict=True):
        shifts |= {n: s for n, s in inertia_shifts(*motion).items() if abs(s) > abs(shifts.get(n, 0.0))}
    timing, masses = drive_timing(test), wrong_masses(test)
    result = replace(result, timing=timing, masses=masses, lacking=lacking, inertia_shifts=shifts)
    result = replace(result, torque_readings=torque_readings(test))
    if stage is None or result.saturated or result.exchanged:
        return result
    return replace(
        result, asked=asked_by_regression(replace(result.robot, sensors=result.start.sensors), recordings, test)
    )


def _suspects(solved: Solved) -> Suspects:
    """What a part of the samples does not rule out, where there are many."""
    suspects, windows = Suspects.of(solved.robot), tested_on_windows(solved)
    return suspects if windows is None else suspects.left_by(windows)
