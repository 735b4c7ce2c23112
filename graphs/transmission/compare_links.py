# SPDX-License-Identifier: BSD-3-Clause
"""Models of a robot with free links against a recording: each sensor predicted from the others.

Zeros and biases are fitted to the recording, everything else is the model's own. Such a prediction has no state that
could run away, so its error is the same at every horizon.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from jointscope.factors.calibration import DYNAMICS, rotation_block
from jointscope.graphs.calibration.calibrate import check_recordings
from jointscope.graphs.comparison.compare import compared, worst_windows
from jointscope.graphs.comparison.comparison_result import (
    SENSOR_NOISE,
    ChannelComparison,
    ComparisonResult,
    ModelComparison,
    SensorPrediction,
)
from jointscope.graphs.comparison.open_loop import OPEN_LOOP
from jointscope.graphs.comparison.predictions_ahead import HORIZONS
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.graphs.transmission.calibrate_links import solved
from jointscope.graphs.transmission.free_links import EquationRows, FreeLinks
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording


@in_solver_context
def compare_links(
    robots: Mapping[str, Robot], recording: Recording, *, progress: Progress | None = None
) -> ComparisonResult:
    """Compares models with a recording; arguments and errors as of `compare`."""
    return compared(robots, recording, compare_links_model, progress)


def compare_links_model(label: str, robot: Robot, recording: Recording) -> ModelComparison:
    """Compares one model with a recording."""
    check_recordings(robot, [recording], every_joint=False)
    problems = FreeLinks.of(robot, [recording])
    hold = (DYNAMICS, *(rotation_block(gyro.name) for gyro in robot.gyros))
    rows = problems[0].rows(solved(problems, hold).estimate.calibrations[0])
    sensors = {r.equation.name: _prediction(r) for r in rows}
    channels = {c: _comparison(r, j) for r in rows for j, c in enumerate(r.equation.channels)}
    squares = [(c.horizons[OPEN_LOOP] / c.noise_sigma) ** 2 for c in channels.values()]
    error = float(np.sqrt(np.mean(squares)))
    return ModelComparison(label, robot, error, SENSOR_NOISE, channels, worst_windows(sensors), sensors)


def _prediction(rows: EquationRows) -> SensorPrediction:
    e = rows.equation
    units, sigmas = (e.unit,) * len(e.channels), np.full(len(e.channels), e.sigma)
    return SensorPrediction(e.channels, units, sigmas, e.times, e.measured, rows.predicted, rows.predicted)


def _comparison(rows: EquationRows, j: int) -> ChannelComparison:
    e = rows.equation
    measured, left = e.measured[:, j], rows.residual[:, j] * e.sigma
    rms, spread = float(np.sqrt(np.mean(left**2))), float(np.std(measured))
    horizons = dict.fromkeys([*map(str, HORIZONS), OPEN_LOOP], rms)
    fit = 100.0 * (1.0 - rms / spread) if spread > 0.0 else float("nan")
    return ChannelComparison(horizons, fit, e.sigma, e.unit)
