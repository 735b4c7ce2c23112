# SPDX-License-Identifier: BSD-3-Clause
"""Files that a result was made from: its recordings and the files of its robots, which no other file may replace."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.comparison.comparison_result import ComparisonResult
from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult


def recorded_files(found: Any) -> list[str]:
    """Paths of its recordings; of those that are no file, none."""
    if isinstance(found, CalibrationResult):
        paths = [bag.recording.path for bag in found.bags]
    elif isinstance(found, ComparisonResult):
        paths = [found.recording.path]
    elif isinstance(found, Diagnosis | Discovery):
        paths = [recording.path for recording in (*found.recordings, found.heldout) if recording is not None]
    else:
        paths = [found.source.path] if isinstance(found, ReplayResult) else []
    return [path for path in paths if path]


def robot_files(found: Any) -> list[Path]:
    """Files of the robots that it began with."""
    if isinstance(found, CalibrationResult):
        return [found.start.path]
    if isinstance(found, ComparisonResult):
        return [model.robot.path for model in found.models]
    if isinstance(found, Discovery):
        return [found.steps[0].robot.path]
    return [found.robot.path] if isinstance(found, Diagnosis | ReplayResult) else []
