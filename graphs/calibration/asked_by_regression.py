# SPDX-License-Identifier: BSD-3-Clause
"""What a regression of each rigid joint alone says of a calibration's recordings.

Joint by joint, without states and without process noise that takes what is missing. A cause that explains less than
another one at the same joint is not said: two reasons for one thing are one too many.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.scoring.changed_load import changed_load
from jointscope.graphs.scoring.joint_regression import joint_rows
from jointscope.graphs.scoring.load_friction import load_frictions
from jointscope.graphs.scoring.regressed_causes import confirmed, regressed_causes
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.graphs.scoring.unsteady_gains import explain_more, unsteady_gains
from jointscope.robots.recordings.recording import Recording


def asked_by_regression(
    result: CalibrationResult, test: ScoreTest, recordings: Sequence[Recording]
) -> CalibrationResult:
    """With what regression says of each rigid joint: a load, a gain, or friction that changes, or effects; the first.

    Args:
        result: of the calibration.
        test: of the whole recordings, linearised at their solution with the noise used.
        recordings: of the calibration.
    """
    if result.saturated:
        return result
    # noise of encoders as it was before a model that lacks something took a part of it
    robot = replace(result.robot, sensors=result.start.sensors)
    rows = joint_rows(robot, recordings)
    if rows is None:
        return result
    changed = changed_load(rows, [recording.path for recording in recordings])
    causes, gains = confirmed(regressed_causes(rows), test), unsteady_gains(rows)
    better = [cause for cause in causes if changed and cause.joint == changed.joint]
    if changed and not any(1.0 - cause.explained < changed.left for cause in better):
        return replace(result, changed=changed)
    if explain_more(gains, causes):
        return replace(result, gains=gains)
    return replace(result, causes=causes, load_frictions=() if causes else load_frictions(rows))
