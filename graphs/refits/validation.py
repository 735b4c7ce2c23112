# SPDX-License-Identifier: BSD-3-Clause
"""Prediction error of a model on stretches of the training recordings that it was not fitted to.

Causal states come from an extended Kalman filter that runs through the whole recording; only predictions that begin
and end inside a stretch count. The start of each piece of the filter is linearised around the base model's states, so
no recording is smoothed anew for a candidate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.base_model import BaseModel, Span
from jointscope.graphs.comparison.causal_filter import filter_states
from jointscope.graphs.comparison.compare import smooth
from jointscope.graphs.comparison.free_run import free_run, loop_error
from jointscope.graphs.comparison.prediction import Predictor
from jointscope.graphs.comparison.predictions_ahead import HORIZON, Ahead, predict_ahead
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.known_values import knowing, with_known_values
from jointscope.graphs.refits.loop_validation import judged_by_loop, loop_squares
from jointscope.robots.errors import JointscopeError
from jointscope.robots.model.encoder_plays import unlagged
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

SHORT = 0.01  # [s] a second horizon: what helps only at one of them is not believed


@dataclass(frozen=True)
class ValidationError:
    """Root mean square error over all channels, in sensor sigmas.

    Attributes:
        error: 0.1 s ahead.
        short: 0.01 s ahead.
        by_span: 0.1 s ahead on each stretch, shape (spans,); NaN where no prediction ends.
        channels: 0.1 s ahead by channel.
    """

    error: float
    short: float
    by_span: Array
    channels: Mapping[str, float]


def validation_error(
    base: BaseModel, robot: Robot, biases: Sequence[Calibration], spans: Sequence[Span]
) -> ValidationError:
    """Errors of a model on stretches of the base model's recordings.

    Args:
        base: gives recordings and states.
        robot: the model, with its process noise.
        biases: shared values that hold the biases of each recording.
        spans: where predictions count.
    """
    squares: dict[float, list[list[Array]]] = {HORIZON: [[] for _ in spans], SHORT: [[] for _ in spans]}
    channels = robot.channels
    for bag in sorted({span.bag for span in spans}):
        recording = base.recordings[bag]
        problem = BagProblem.of(knowing(robot), recording)
        calibration = Calibration.of(problem.robot).with_points(biases[bag].own)
        x = unlagged(robot, base.states_at(bag, problem.timeline.ticks, robot.layout), known=base.layout.memories)
        causal = filter_states(problem, calibration, x)
        predictor = Predictor(problem.robot, problem.timeline)
        for horizon, target in squares.items():
            ahead = predict_ahead(problem, calibration, predictor, causal, horizon)
            for i, span in enumerate(spans):
                if span.bag == bag:
                    target[i].append(_squares(problem, ahead, span, horizon))
    short = _root_mean(_mean_by_channel(squares[SHORT], len(channels)))
    return _summed(squares[HORIZON], short, channels)


def fit_and_judge(base: BaseModel) -> tuple[list[Span], list[Span]]:
    """Spans of the training recordings on which a refit is fitted, and those on which it is judged.

    Predictions are judged where the refit has not been. A loop is not what is fitted: there whole recordings may be
    used for both, and short ones can be judged, which cut in pieces would leave too little to fit.
    """
    fit, validation = base.spans()
    if not judged_by_loop(base.robot, base.recordings):
        return fit, validation
    ticks = [base.problem_ticks(bag) for bag in range(len(base.recordings))]
    return [Span(bag, float(t[0]), float(t[-1])) for bag, t in enumerate(ticks)], fit + validation


def judged_error(
    base: BaseModel, robot: Robot, biases: Sequence[Calibration], spans: Sequence[Span]
) -> ValidationError:
    """What a model is judged by: the loop simulated from its goals where that can be done, else predictions.

    Arguments as in `validation_error`. Without predictions, `short` is not known.
    """
    if not judged_by_loop(base.robot, base.recordings):
        return validation_error(base, robot, biases, spans)
    squares = [[part] for part in loop_squares(robot, base.recordings, spans)]
    return _summed(squares, float("nan"), robot.motor_encoder.channels)


def _summed(squares: Sequence[Sequence[Array]], short: float, channels: tuple[str, ...]) -> ValidationError:
    """From sums and counts of squared errors by span, and the error at the short horizon."""
    mean = _mean_by_channel(squares, len(channels))
    by_span = np.array([_root_mean(_mean_by_channel([parts], len(channels))) for parts in squares])
    by_channel = dict(zip(channels, map(float, np.sqrt(mean)), strict=True))
    return ValidationError(_root_mean(mean), short, by_span, by_channel)


def _squares(problem: BagProblem, ahead: dict[str, Ahead], span: Span, horizon: float) -> Array:
    """Sum and count of squared errors per channel, shape (2, c)."""
    columns = []
    for name, sensor in problem.robot.sensors.items():
        stream, p = problem.recording.streams[name], ahead[name]
        times = stream.times[p.sample]
        inside = (times >= span.t0 + horizon) & (times <= span.t1)
        error = (stream.values[p.sample[inside]] - p.predicted[inside]) / sensor.sigmas
        good = np.isfinite(error)
        columns.append(np.array([np.sum(np.where(good, error, 0.0) ** 2, axis=0), np.sum(good, axis=0)]))
    return np.hstack(columns)


def _mean_by_channel(parts: Sequence[Sequence[Array]], channels: int) -> Array:
    total = sum((part for span in parts for part in span), np.zeros((2, channels)))
    return np.divide(total[0], total[1], out=np.full(channels, np.nan), where=total[1] > 0)


def _root_mean(squares: Array) -> float:
    return float(np.sqrt(np.mean(squares))) if np.all(np.isfinite(squares)) else float("nan")


def heldout_error(robot: Robot, recording: Recording) -> float:
    """The error by which `compare` judges a model on a recording that no fit has seen; biases are fitted to it."""
    if judged_by_loop(robot, [recording]):
        return loop_error(free_run(robot, recording), robot)
    problem, x, calibration = smooth(robot, recording)
    causal = filter_states(*with_known_values(problem, calibration), x)
    ahead = predict_ahead(problem, calibration, Predictor(problem.robot, problem.timeline), causal, HORIZON)
    everything = Span(0, -np.inf, np.inf)
    return _root_mean(_mean_by_channel([[_squares(problem, ahead, everything, 0.0)]], len(robot.channels)))


def reported_heldout_error(robot: Robot, recording: Recording | None) -> float:
    """The same, which is only reported: NaN without a recording or where the model cannot follow it."""
    if recording is None:
        return float("nan")
    try:
        return heldout_error(robot, recording)
    except (JointscopeError, np.linalg.LinAlgError):
        return float("nan")
