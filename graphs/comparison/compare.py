# SPDX-License-Identifier: BSD-3-Clause
"""Measured against predicted, the verification of the paper (Sec. 5.2) and k-step-ahead predictions.

Biases and, for a robot that was never calibrated, process noise are fitted to the recording; everything else is the
model's own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration, rotation_block
from jointscope.graphs.calibration.base_model import with_full_gyros
from jointscope.graphs.calibration.calibrate import calibrate, check_recordings
from jointscope.graphs.calibration.external_torque import external_torques_of
from jointscope.graphs.calibration.stages.whole_stage import approach
from jointscope.graphs.comparison.causal_filter import filter_states
from jointscope.graphs.comparison.comparison_result import (
    ChannelComparison,
    ComparisonResult,
    ModelComparison,
    SensorPrediction,
    WorstWindow,
)
from jointscope.graphs.comparison.free_run import FreeRun, free_run
from jointscope.graphs.comparison.noise_floor import SETTLING, channel_floors
from jointscope.graphs.comparison.open_loop import Horizons, OpenLoop
from jointscope.graphs.comparison.prediction import Predictor
from jointscope.graphs.comparison.predictions_ahead import HORIZON, HORIZONS, Ahead, predict_ahead, predict_open_loop
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.joint_states import JointStates
from jointscope.graphs.problem.known_values import carried, with_known_values
from jointscope.graphs.solving.batch_solver import Progress, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.graphs.starts.drive_signal import with_known_drive_signal
from jointscope.graphs.starts.initial_guess import initial_biases
from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Sensor
from jointscope.robots.recordings.recording import Recording, Stream

Array = NDArray[np.float64]

ROUNDS = 2  # of smoothing, the second where the first sees blows that the measurements alone did not show

WINDOW = 0.25  # [s] length of the windows among which the worst are sought
WORST = 8


@in_solver_context
def compare(robots: Mapping[str, Robot], recording: Recording, *, progress: Progress | None = None) -> ComparisonResult:
    """Compares models with a recording.

    Args:
        robots: models by label.
        recording: preferably one that was not used for calibration.
        progress: called with a text and the share done, from 0 to 1.

    Raises:
        RecordingError: the recording cannot be a measurement of these robots.
        RobotError: no robot given.
        SolveError: the states of the recording cannot be estimated.
    """
    return compared(robots, recording, compare_model, progress)


def compared(
    robots: Mapping[str, Robot],
    recording: Recording,
    one: Callable[[str, Robot, Recording], ModelComparison],
    progress: Progress | None,
) -> ComparisonResult:
    """Compares models, each by a function; arguments and errors as of `compare`."""
    if not robots:
        raise RobotError("no robot given; pass at least one")
    models = []
    for i, (label, robot) in enumerate(robots.items()):
        if progress:
            progress(f"comparing {label}", i / len(robots))
        models.append(one(label, robot, recording))
    return ComparisonResult(recording, _with_one_floor(models))


def _with_one_floor(models: Sequence[ModelComparison]) -> tuple[ModelComparison, ...]:
    """The models with the floor of the best: random torques are the machine's, whichever model looks at it.

    What a worse one calls noise is in part what it lacks; beside its own floor it would look as good as the best.
    Models that predict other channels keep their own.
    """
    best = min(models, key=lambda model: model.error)
    same = [model.floors.keys() == best.floors.keys() for model in models]
    return tuple(
        replace(model, floor=best.floor, floors=best.floors) if shared else model
        for model, shared in zip(models, same, strict=True)
    )


def compare_model(label: str, robot: Robot, recording: Recording) -> ModelComparison:
    """Compares one model with a recording."""
    problem, states, calibration = smooth(robot, recording)
    robot = problem.robot
    predictor = Predictor(robot, problem.timeline)
    causal = filter_states(*with_known_values(problem, calibration), states)
    ahead = {h: predict_ahead(problem, calibration, predictor, causal, h) for h in HORIZONS}
    open_loop = OpenLoop(lambda: predict_open_loop(problem, calibration, predictor, states[0]))
    sensors = {
        name: _sensor_prediction(recording.streams[name], robot.sensors[name], ahead, open_loop)
        for name in robot.sensors
    }
    channels = _channels(robot, recording, ahead, open_loop)
    if recording.left_out and not any(len(p.sample) for p in ahead[HORIZON].values()):
        raise RecordingError(
            f"{recording.path}: nothing is left to judge a model by; expected stretches of at least "
            f"{SETTLING + HORIZON:g} s between those that are left out"
        )
    error = float(np.sqrt(np.mean([(c.horizons[str(HORIZON)] / c.noise_sigma) ** 2 for c in channels.values()])))
    floors = channel_floors(problem, states, calibration, HORIZON)
    return ModelComparison(
        label=label,
        robot=robot,
        error=error,
        floor=float(np.sqrt(np.mean(np.square(list(floors.values()))))),
        channels=channels,
        worst=worst_windows(sensors),
        sensors=sensors,
        floors=floors,
        motion=JointStates.of(robot, problem.timeline.ticks, states),
        predicted_motion=_predicted_motion(robot, recording, ahead[HORIZONS[0]]),
        free_run=_free_run(robot, recording),
        isolated=external_torques_of(problem, states, calibration),
    )


def _free_run(robot: Robot, recording: Recording) -> FreeRun | None:
    """The whole loop simulated, where robot and recording allow it."""
    if robot.controller is None or recording.goal is None:
        return None
    try:
        return free_run(robot, recording)
    except (RobotError, RecordingError):
        return None


def smooth(robot: Robot, recording: Recording) -> tuple[BagProblem, Array, Calibration]:
    """Smoothed states and biases of a recording under a model whose parameters stay as they are.

    All three components of every gyro are predicted from the state, also where the robot calibrates with the forms of
    the paper. A robot that was never calibrated gets process noise from the recording.
    """
    check_recordings(robot, [recording], every_joint=False)
    robot = with_full_gyros(with_known_drive_signal(robot, [recording]))
    sigmas = [parameter.sigma for parameter in robot.parameters.values()]
    calibrated = "calibration" in robot.document or any(sigma is not None for sigma in sigmas)
    if robot.noise.estimate and not calibrated:
        result = calibrate(robot, [recording], biases_only=True)
        problem = BagProblem.of(replace(robot, noise=result.noise), recording)
        return problem, _at_ticks(problem, result.bags[0].ticks, result.bags[0].states), result.bags[0].calibration
    problem = BagProblem.of(robot, recording)
    known, start = with_known_values(problem, Calibration.of(robot))
    hold = (DYNAMICS, *(rotation_block(gyro.name) for gyro in robot.gyros))
    first = approach([known], robot.noise, [initial_biases(known, start)], hold)
    estimate, short = first, known
    for i in range(ROUNDS):
        divided, x = short.divided(estimate.states[0], {})
        if i and divided is short:
            break
        short = divided
        estimate = solve([short], Estimate((x,), estimate.calibrations), hold=hold).estimate
    x = _at_ticks(problem, short.timeline.ticks, estimate.states[0])
    return problem, x, carried(estimate.calibrations[0], Calibration.of(robot))


def _at_ticks(problem: BagProblem, ticks: Array, x: Array) -> Array:
    """States at the ticks of a problem among those at its own and at others, which divide its steps."""
    return x[np.searchsorted(ticks, problem.timeline.ticks)]


def _sensor_prediction(
    stream: Stream, sensor: Sensor, ahead: dict[float, dict[str, Ahead]], open_loop: OpenLoop
) -> SensorPrediction:
    at_samples = {}
    for horizon in (HORIZONS[0], HORIZON):
        at_samples[horizon] = np.full(stream.values.shape, np.nan)
        at_samples[horizon][ahead[horizon][sensor.name].sample] = ahead[horizon][sensor.name].predicted
    return SensorPrediction(
        sensor.channels,
        sensor.units,
        sensor.sigmas,
        stream.times,
        stream.values,
        open_loop.of(sensor.name),
        at_samples[HORIZON],
        at_samples[HORIZONS[0]],
    )


def _predicted_motion(robot: Robot, recording: Recording, ahead: dict[str, Ahead]) -> JointStates | None:
    """Motion where predictions of the motor encoders end; None without predictions."""
    name = robot.motor_encoder.name
    sample, first = np.unique(ahead[name].sample, return_index=True)
    if len(sample) < 2:
        return None
    return JointStates.of(robot, recording.streams[name].times[sample], ahead[name].states[first])


def _channels(
    robot: Robot, recording: Recording, ahead: dict[float, dict[str, Ahead]], open_loop: OpenLoop
) -> dict[str, ChannelComparison]:
    found = {}
    for name, sensor in robot.sensors.items():
        measured = recording.streams[name].measured
        for j, channel in enumerate(sensor.channels):
            known = {}
            for horizon, predictions in ahead.items():
                p = predictions[name]
                known[str(horizon)] = _rms(measured[p.sample, j] - p.predicted[:, j])
            horizons = Horizons(known, _open_loop_error(open_loop, name, measured[:, j], j))
            p = ahead[HORIZON][name]
            seen = ~np.isnan(p.predicted[:, j])
            y, predicted = measured[p.sample[seen], j], p.predicted[seen, j]
            spread = float(np.linalg.norm(y - y.mean())) if len(y) else 0.0
            fit = 100.0 * (1.0 - float(np.linalg.norm(y - predicted)) / spread) if spread > 0 else float("nan")
            found[channel] = ChannelComparison(horizons, fit, float(sensor.sigmas[j]), sensor.units[j])
    return found


def _open_loop_error(open_loop: OpenLoop, sensor: str, measured: Array, column: int) -> Callable[[], float]:
    """Finds the error of one channel."""
    return lambda: _rms(measured - open_loop.sensors[sensor][:, column])


def _rms(error: Array) -> float:
    """Infinite where a prediction has run away; NaN says that there is none."""
    error = error[~np.isnan(error)]
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.mean(error**2))) if len(error) else float("nan")


def worst_windows(sensors: dict[str, SensorPrediction]) -> tuple[WorstWindow, ...]:
    """The windows with the largest share of the squared error in sigmas."""
    found, total = [], 0.0
    for sensor in sensors.values():
        squares = ((sensor.measured - sensor.ahead) / sensor.sigmas) ** 2
        t0 = float(sensor.times[0])
        index = ((sensor.times - t0) / WINDOW).astype(int)
        for j, channel in enumerate(sensor.channels):
            valid = np.isfinite(squares[:, j])
            mean = float(np.mean(squares[valid, j])) if np.any(valid) else 0.0
            total += mean
            sums = np.bincount(index[valid], weights=squares[valid, j])
            count = max(int(valid.sum()), 1)
            for window in np.argsort(-sums)[:WORST]:
                start = t0 + float(window) * WINDOW
                found.append(WorstWindow(channel, start, start + WINDOW, float(sums[window]) / count))
    found = [replace(w, share=w.share / max(total, 1e-300)) for w in found]
    return tuple(sorted(found, key=lambda w: -w.share)[:WORST])
