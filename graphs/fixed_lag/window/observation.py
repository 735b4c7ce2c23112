# SPDX-License-Identifier: BSD-3-Clause
"""A sample of a sensor on its way into the estimator, and the rows that it becomes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.accelerated import acceleration_weights
from jointscope.factors.interpolated import interpolate, smoothed, weights_between
from jointscope.graphs.fixed_lag.window.augmented_layout import AugmentedLayout
from jointscope.robots.model.readings_at_one_state import ReadingsAtOneState

Array = NDArray[np.float64]

AT_TICK = 1e-6  # [s] a sample this near to a tick was taken at it


@dataclass(frozen=True)
class Observation:
    """Some channels of one sample.

    Attributes:
        sensor: name.
        stamp: as it came [s].
        taken: when it was measured: the stamp without the lateness that the robot file knows of [s].
        channels: indices of the channels, shape (c,).
        values: shape (c,) [unit of the sensor].
        sigma: shape (c,).
        variance: over time, of the weights of the filter that smoothed it [s^2].
    """

    sensor: str
    stamp: float
    taken: float
    channels: NDArray[np.intp]
    values: Array
    sigma: Array
    variance: float = 0.0

    def needs_step(self, readings: ReadingsAtOneState) -> bool:
        """Whether its reading depends on how the state changes, so on both ends of the step."""
        return self.variance != 0.0 or readings.feels_acceleration(self.sensor)


@dataclass(frozen=True)
class ObservedRows:
    """Observations linearised at the two ends of a step.

    Attributes:
        residual: measured - predicted, shape (r,).
        by_start: derivative of the prediction by the state at the beginning, shape (r, D); None where all samples were
            taken at the end.
        by_end: by the state at the end, shape (r, D).
        sigma: of the samples, shape (r,).
        parts: rows of each observation.
    """

    residual: Array
    by_start: Array | None
    by_end: Array
    sigma: Array
    parts: tuple[slice, ...]

    def chosen(self, keep: NDArray[np.bool_]) -> ObservedRows:
        """Only some of the rows; parts stay as they were."""
        by_start = None if self.by_start is None else self.by_start[keep]
        return ObservedRows(self.residual[keep], by_start, self.by_end[keep], self.sigma[keep], self.parts)


def observed_rows(
    readings: ReadingsAtOneState,
    layout: AugmentedLayout,
    observations: Sequence[Observation],
    x0: Array | None,
    x1: Array,
    times: tuple[float, float],
    u: Array,
) -> ObservedRows:
    """Linearises samples that were taken in a step.

    Args:
        readings: predicts them.
        layout: of the states.
        observations: taken in [t0, t1].
        x0: state at the beginning, shape (D,); None where all samples were taken at the end, and none of them is an
            acceleration or smoothed.
        x1: state at the end, shape (D,).
        times: of beginning and end of the step [s].
        u: mean command of the step, shape (n,).
    """
    t0, t1 = times
    d, total = layout.d, sum(len(o.values) for o in observations)
    residual, sigma = np.empty(total), np.empty(total)
    by_end = np.zeros((total, layout.size))
    by_start: Array | None = None
    own, parts, row = x1[:d], [], 0
    for o in observations:
        part = slice(row, row + len(o.values))
        row = part.stop
        parts.append(part)
        sigma[part] = o.sigma
        if x0 is None or (o.taken >= t1 - AT_TICK and not o.needs_step(readings)):
            at = np.concatenate([own, u]) if readings.feels_command(o.sensor) else own
            reading, J = readings.read(o.sensor, at, o.stamp)
            by_end[part, :d] = J if len(J) == len(o.channels) else J[o.channels]
        else:
            h, s = t1 - t0, (o.taken - t0) / (t1 - t0)
            at = interpolate(layout.robot, x0[None, :d], x1[None, :d], np.array([s]), np.array([h]))[0]
            if o.variance:
                smoothed(layout.robot, at[None], x0[None, :d], x1[None, :d], np.array([h]), o.variance)
            if readings.feels_acceleration(o.sensor):
                at = np.concatenate([at, _acceleration(layout, x0, x1, s, h)])
            elif readings.feels_command(o.sensor):
                at = np.concatenate([at, u])
            reading, J = readings.read(o.sensor, at, o.stamp)
            if by_start is None:
                by_start = np.zeros((total, layout.size))
            J0, J1 = _split(layout, J[o.channels], s, h)
            if o.variance:
                by_velocity = 0.5 * o.variance / h * J[o.channels][:, layout.robot.positions]
                J0[:, layout.robot.velocities] -= by_velocity
                J1[:, layout.robot.velocities] += by_velocity
            by_start[part, :d], by_end[part, :d] = J0, J1
        predicted = reading[o.channels]
        bias = layout.biases.get(o.sensor)
        if bias is not None:
            predicted = predicted + x1[bias][o.channels]
            by_end[np.arange(part.start, part.stop), bias.start + o.channels] = 1.0
        residual[part] = o.values - predicted
    return ObservedRows(residual, by_start, by_end, sigma, tuple(parts))


def _acceleration(layout: AugmentedLayout, x0: Array, x1: Array, s: float, h: float) -> Array:
    """Accelerations of the links in a step, shape (n_link,) [rad/s^2]; see `AcceleratedFactor`."""
    q, v = layout.robot.q_link, layout.robot.v_link
    w = [weight[0] for weight in acceleration_weights(np.array([s]), np.array([h]))]
    return np.asarray(w[0] * x0[q] + w[1] * x0[v] + w[2] * x1[q] + w[3] * x1[v], dtype=np.float64)


def _split(layout: AugmentedLayout, J: Array, s: float, h: float) -> tuple[Array, Array]:
    """Derivatives by both ends of a step of something that depends on the state in between, shape (c, d) each.

    J has shape (c, d), or (c, d + n_link) where accelerations stand behind the state.
    """
    own = layout.robot
    q, v, z = own.positions, own.velocities, own.memory
    position, velocity = weights_between(np.array([s]), np.array([h]))
    J_q, J_v, parts = J[:, q], J[:, v], []
    by_a = J[:, layout.d :]
    for i in (0, 2):
        part = np.zeros((len(J), layout.d))
        part[:, q] = position[i] * J_q + velocity[i] * J_v
        part[:, v] = position[i + 1] * J_q + velocity[i + 1] * J_v
        part[:, z] = (1.0 - s if i == 0 else s) * J[:, z]
        if by_a.shape[1]:
            weights = acceleration_weights(np.array([s]), np.array([h]))
            part[:, own.q_link] += weights[i] * by_a
            part[:, own.v_link] += weights[i + 1] * by_a
        parts.append(part)
    return parts[0], parts[1]
