# SPDX-License-Identifier: BSD-3-Clause
"""Error of the loop simulated from its goals: how models of position-controlled drives are judged.

Predictions a tenth of a second ahead start from the measured state and are driven by the measured command; between slow
goals the random torques that no model holds are then as large as what a wrong friction does. Simulated with its
controller the model has nothing but the goals, and its friction decides where it stops.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.base_model import Span
from jointscope.graphs.comparison.free_run import FreeRun, free_run
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.controller_gain import controller_of
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]


def judged_by_loop(robot: Robot, recordings: Sequence[Recording]) -> bool:
    """Whether the loop can be simulated: a controller with a known gain, and goals in all recordings."""
    if any(recording.goal is None for recording in recordings):
        return False
    try:
        return all(controller_of(robot, recording) is not None for recording in recordings)
    except RecordingError:
        return False


def loop_squares(robot: Robot, recordings: Sequence[Recording], spans: Sequence[Span]) -> list[Array]:
    """Sum and count of squared errors [sensor sigma] of each channel of the motor encoder, shape (2, n), by span.

    Raises:
        RobotError: the loop cannot be simulated with this model.
        RecordingError: a recording lacks what the simulation needs.
    """
    runs = {bag: free_run(robot, recordings[bag]) for bag in sorted({span.bag for span in spans})}
    return [_squares(runs[span.bag], robot, span) for span in spans]


def _squares(run: FreeRun, robot: Robot, span: Span) -> Array:
    inside = (run.times >= span.t0) & (run.times <= span.t1)
    error = (run.simulated[inside] - run.measured[inside]) / robot.motor_encoder.sigmas
    return np.array([np.nansum(error**2, axis=0), np.sum(~np.isnan(error), axis=0)])
