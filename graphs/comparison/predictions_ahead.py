# SPDX-License-Identifier: BSD-3-Clause
"""What every sensor would read if the model ran on from a state, with the commands alone.

Predictions ahead start from causal states, which use data up to their start only. Open loop starts from one state.
Accelerometers read what the equations of motion say at the predicted state, not differences of predicted velocities.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.interpolated import interpolate, smoothed
from jointscope.graphs.comparison.causal_filter import FilteredStates
from jointscope.graphs.comparison.noise_floor import are_judged, settled_from
from jointscope.graphs.comparison.prediction import Predictor
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.sensor_placement import ACCELERATION, COMMAND, factor_on_state, feels
from jointscope.graphs.problem.timeline import Timeline
from jointscope.robots.model.lateness import Lateness, late_channels, taken
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

HORIZON = 0.1  # [s] the horizon of `error`
HORIZONS = (0.01, 0.1, 1.0)  # [s]
SPACING = {0.01: 0.01, 0.1: 0.01, 1.0: 0.1}  # [s] between starts, by horizon


@dataclass(frozen=True)
class Ahead:
    """Predictions that end near the samples of one sensor.

    Attributes:
        sample: index of the sample in its stream, shape (s,).
        predicted: predicted measurement, shape (s, c).
        states: predicted states, shape (s, d).
    """

    sample: NDArray[np.intp]
    predicted: Array
    states: Array


@dataclass(frozen=True)
class _Group:
    """Channels of a sensor that were sampled at the same instants.

    Attributes:
        sensor: name.
        channels: indices of the channels.
        taken: when the samples were really taken, shape (m,) [s].
        behind: what it feels beside the state: accelerations of the links, the acting command, or nothing.
        variance: over time, of the weights of the filter that smoothed them [s^2].
    """

    sensor: str
    channels: NDArray[np.intp]
    taken: Array
    behind: str
    variance: float

    def steps(self, timeline: Timeline, times: Array) -> NDArray[np.intp]:
        """Steps in which samples at these times were taken."""
        return (timeline.locate_ending(times) if self.behind else timeline.locate(times))[0]

    def at(
        self, problem: BagProblem, predictor: Predictor, step: NDArray[np.intp], times: Array, ends: tuple[Array, Array]
    ) -> Array:
        """What its factor asks for: states between two ticks, with what it feels behind them."""
        x = _between(problem, step, times, *ends)
        if self.variance:
            smoothed(problem.robot.layout, x, *ends, problem.timeline.h[step], self.variance)
        if not self.behind:
            return x
        return (predictor.with_accelerations if self.behind == ACCELERATION else predictor.with_commands)(x, step)

    def size_behind(self, robot: Robot) -> int:
        """Number of columns behind the state."""
        return {ACCELERATION: robot.layout.n_link, COMMAND: robot.n}.get(self.behind, 0)


def predict_ahead(
    problem: BagProblem, calibration: Calibration, predictor: Predictor, causal: FilteredStates, horizon: float
) -> dict[str, Ahead]:
    """Predictions `horizon` seconds ahead from starts all over the recording, by sensor."""
    timeline = problem.timeline
    ticks, h = timeline.ticks, float(np.median(timeline.h))
    stride = max(round(SPACING[horizon] / h), 1)
    groups = _groups(problem)
    latest = max(
        float(np.max(np.abs(problem.recording.streams[g.sensor].times - g.taken), initial=0.0)) for g in groups
    )
    longest = int(np.ceil((horizon + latest + 2.0 * h) / float(np.min(_sums(timeline.h, horizon)))))
    start = np.arange(np.searchsorted(ticks, settled_from(problem)), len(ticks) - 1 - longest, stride)
    if len(start) == 0:
        return {
            name: Ahead(np.zeros(0, np.intp), np.zeros((0, len(s.channels))), causal.mean[:0])
            for name, s in problem.robot.sensors.items()
        }
    judged = are_judged(problem, start, horizon)
    streams = problem.recording.streams
    wanted = {
        g.sensor: _target_samples(g.taken, float(np.min(streams[g.sensor].periods)), ticks[start] + horizon)
        for g in reversed(groups)
    }
    taken = [g.taken[wanted[g.sensor][0]] for g in groups]
    steps = [g.steps(timeline, times) for g, times in zip(groups, taken, strict=True)]
    d = causal.mean.shape[1]
    found = [np.full((len(start), d + g.size_behind(problem.robot)), np.nan) for g in groups]
    for step, before, after in predictor.paths(causal.mean[start], start, longest):
        for group, states, times, ends in zip(groups, found, taken, steps, strict=True):
            here = ends == step
            if np.any(here):
                states[here] = group.at(problem, predictor, step[here], times[here], (before[here], after[here]))
    result = {}
    for name, (sample, near) in wanted.items():
        own = [(g, states) for g, states in zip(groups, found, strict=True) if g.sensor == name]
        good = near & np.all([np.all(np.isfinite(states), axis=1) for _, states in own], axis=0)
        good &= judged
        stamps = problem.recording.streams[name].times[sample[good]]
        predicted = np.full((len(stamps), len(problem.robot.sensors[name].channels)), np.nan)
        for group, states in own:
            all_channels = predict_sensor(problem.robot, name, states[good], calibration, stamps)
            predicted[:, group.channels] = all_channels[:, group.channels]
        nothing_to_compare = problem.recording.streams[name].filled
        if nothing_to_compare is not None:
            predicted[nothing_to_compare[sample[good]]] = np.nan
        result[name] = Ahead(sample[good], predicted, own[0][1][good, :d])
    return result


def _groups(problem: BagProblem) -> list[_Group]:
    """All channels of all sensors, by when they were sampled."""
    found = []
    for name, sensor in problem.robot.sensors.items():
        stamps = problem.recording.streams[name].times
        for channels, late in late_channels(problem.robot, name):
            lateness = Lateness.of(problem.robot, late, stamps)
            variance = lateness.variance(problem.robot.values)[0]
            found.append(_Group(name, channels, taken(problem.robot, name, late, stamps), feels(sensor), variance))
    return found


def _sums(h: Array, horizon: float) -> Array:
    """Mean step over every stretch of about the horizon, shape (k,)."""
    count = max(min(int(horizon / float(np.median(h))), len(h)), 1)
    total = np.convolve(h, np.ones(count), mode="valid")
    return total / count


def _target_samples(taken: Array, period: float, times: Array) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Nearest of the samples, taken at these instants, to each time, and whether it lies within half a period.

    The period is that of the fastest node, however soon others speak behind it.
    """
    right = np.clip(np.searchsorted(taken, times), 1, len(taken) - 1)
    nearest = np.where(times - taken[right - 1] < taken[right] - times, right - 1, right)
    return nearest, np.abs(taken[nearest] - times) <= 0.5 * period + 1e-9


def _between(problem: BagProblem, step: NDArray[np.intp], times: Array, before: Array, after: Array) -> Array:
    """States between two ticks."""
    ticks = problem.timeline.ticks
    h = ticks[step + 1] - ticks[step]
    return interpolate(problem.robot.layout, before, after, np.clip((times - ticks[step]) / h, 0.0, 1.0), h)


def predict_sensor(robot: Robot, name: str, x: Array, calibration: Calibration, stamps: Array) -> Array:
    """What a sensor would read at these states with these stamps, shape (s,) [s]; shape (s, c).

    States have shape (s, d); for an accelerometer with link accelerations behind them, (s, d + n_link), for currents
    with acting commands, (s, d + n).
    """
    nothing = np.zeros((len(x), len(robot.sensors[name].channels)))
    return factor_on_state(robot, name, nothing, stamps).residual((x,), calibration)


def predict_open_loop(
    problem: BagProblem, calibration: Calibration, predictor: Predictor, x0: Array
) -> dict[str, Array]:
    """Predictions at all samples from the first state and the commands alone.

    NaN outside the ticks, infinite where the model has run away.
    """
    ticks = problem.timeline.ticks
    path = predictor.path(x0)
    lost = ~np.all(np.isfinite(path), axis=1)
    streams = problem.recording.streams
    found = {name: np.full(streams[name].values.shape, np.nan) for name in problem.robot.sensors}
    for group in _groups(problem):
        inside = (group.taken >= ticks[0]) & (group.taken <= ticks[-1])
        step = group.steps(problem.timeline, group.taken[inside])
        x = group.at(problem, predictor, step, group.taken[inside], (path[step], path[step + 1]))
        stamps = streams[group.sensor].times[inside]
        with np.errstate(invalid="ignore", over="ignore"):
            predicted = predict_sensor(problem.robot, group.sensor, x, calibration, stamps)
        predicted[lost[step + 1]] = np.inf
        found[group.sensor][np.ix_(inside, group.channels)] = predicted[:, group.channels]
    return found
