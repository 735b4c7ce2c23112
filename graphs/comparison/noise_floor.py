# SPDX-License-Identifier: BSD-3-Clause
"""The prediction error that sensor noise and state uncertainty alone would leave, channel by channel.

A missing effect inflates the process noise of a calibration. The floor therefore uses only the white part of it, with
torques that last beside it (see `lasting_noise`). A disturbance that lasts longer than a few milliseconds cannot be
told from a missing effect and is no part of the floor. An encoder's floor grows with the uncertainty of the motion, a
gyro's about an axis that nothing turns about stays at its noise.

Noise acts where it was found. A friction that is rounded off leaves most of it where a joint stands or turns over, and
brakes what it does there; spread over the motion, where nothing does, it would exceed the errors themselves.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.comparison.causal_filter import filter_around
from jointscope.graphs.noise.lasting_noise import separate_noise, without_lasting
from jointscope.graphs.problem.bag_problem import BagProblem, first_command_time
from jointscope.graphs.problem.sensor_placement import ACCELERATION, COMMAND, factor_on_state, feels
from jointscope.graphs.problem.standstill import leaving_standstill_out
from jointscope.robots.errors import SolveError
from jointscope.robots.parts.process_noise import ProcessNoise

Array = NDArray[np.float64]

SETTLING = 0.5  # [s] of motion after which the filter knows the deflection
STARTS = 400  # predictions over which the floor is averaged


def settled_from(problem: BagProblem) -> float:
    """Time from which predictions are scored [s]: the filter has seen half a second of motion.

    At rest friction hides the deflection, and after a start in motion the filter has to find it first; no prediction
    can know it before. At least half of the recording is always scored.
    """
    ticks = problem.timeline.ticks
    motion = first_command_time(problem.recording) if problem.rests else float(ticks[0])
    return min(motion + SETTLING, 0.5 * float(ticks[0] + ticks[-1]))


def are_judged(problem: BagProblem, start: NDArray[np.intp], horizon: float) -> NDArray[np.bool_]:
    """Whether predictions from these ticks are the model's own: nothing left out in them, nor just before, shape (s,).

    Where a stretch that is left out ends, the filter knows no more than at a start in motion. Where a motor stands
    whose friction is stiff, no equation holds its speed: what its encoder alone tells of it is no model's.
    """
    judged = problem.recording.are_judged(problem.timeline.ticks[start] + horizon, horizon + SETTLING)
    told = judged & ~problem.motor_stands(start)
    return told if np.any(told) else judged


def channel_floors(problem: BagProblem, x: Array, calibration: Calibration, horizon: float) -> dict[str, float]:
    """Root mean square of the expected error `horizon` seconds ahead, in sensor sigmas, by channel.

    A model may contradict its recording so much that torques beside it run away; no more is known of its floor
    then than the noise of the sensors.

    Args:
        problem: the recording with the model's noise.
        x: smoothed states, shape (m, d).
        calibration: shared values.
        horizon: prediction horizon [s].
    """
    if problem.robot.noise.n_lasting:
        own = without_lasting(problem.robot)
        x, problem = own.layout.carried_over(x, problem.robot.layout), problem.of_robot(own)
    try:
        quiet = _with_white_noise(problem, x, calibration)
    except SolveError:
        return dict.fromkeys(problem.robot.channels, 1.0)
    filtered = filter_around(quiet, x, calibration)
    steps = max(round(horizon / float(np.median(problem.timeline.h))), 1)
    first = int(np.searchsorted(problem.timeline.ticks, settled_from(problem)))
    last = max(len(x) - 2 - steps, 0)
    start = np.unique(np.linspace(min(first, last), last, STARTS).astype(int))
    judged = are_judged(problem, start, horizon)
    start = start[judged] if np.any(judged) else start
    P = filtered.covariance[start]
    for i in range(min(steps, len(x) - 2)):
        P = _advance(quiet, x, calibration, start + i, P)
    floors = np.sqrt(np.mean(_channel_variances(quiet, x, calibration, start + steps, P), axis=0))
    return dict(zip(problem.robot.channels, map(float, floors), strict=True))


def _with_white_noise(problem: BagProblem, x: Array, calibration: Calibration) -> BagProblem:
    """The problem with its white noise where that acts, as predicted: about a motor that sticks nothing is open."""
    everywhere = separate_noise(problem, x, calibration).white
    moving = problem.of_recording(leaving_standstill_out(problem.robot, problem.recording))
    left_out, free = moving.dynamics.steps.free, problem.dynamics.steps.free
    quiet = problem.as_predicted
    if left_out is None or not moving.recording.sticking:
        return quiet.with_noise(everywhere)
    before = np.zeros_like(left_out) if free is None else free
    stands, told = left_out > before, before == 0.0
    noise = separate_noise(moving, x, calibration).white
    share = np.sum(stands & told, axis=0) / np.maximum(np.sum(told, axis=0), 1)
    whole, own = _squared(everywhere), _squared(noise)
    standing = np.divide(whole - (1.0 - share) * own, share, out=np.zeros_like(share), where=share > 0.0)
    return _not_below(quiet.with_noise(noise), stands * np.sqrt(np.maximum(standing, 0.0)))


def _squared(noise: ProcessNoise) -> Array:
    """Squared densities of velocities, link before motor, shape (k,)."""
    return np.concatenate([noise.link_velocity, noise.motor_velocity]) ** 2


def _not_below(problem: BagProblem, least: Array) -> BagProblem:
    """The problem with at least these densities of velocities in its steps, shape (m, k) [rad/s/sqrt(s)]."""
    steps = problem.dynamics.steps
    free = least if steps.free is None else np.maximum(steps.free, least)
    return replace(problem, dynamics=replace(problem.dynamics, steps=replace(steps, free=free)))


def _advance(problem: BagProblem, x: Array, calibration: Calibration, ticks: NDArray[np.intp], P: Array) -> Array:
    """Covariances one tick later: F P F' + Q."""
    chosen = problem.dynamics.select(ticks)
    linear = chosen.linearize((x[ticks], x[ticks + 1]), calibration)
    J1_inverse = np.linalg.inv(linear.by_state[1])
    F = -J1_inverse @ linear.by_state[0]
    G = J1_inverse * chosen.sigmas[:, None, :]
    return F @ P @ F.transpose(0, 2, 1) + G @ G.transpose(0, 2, 1)


def _channel_variances(
    problem: BagProblem, x: Array, calibration: Calibration, ticks: NDArray[np.intp], P: Array
) -> Array:
    """Expected squared error of every channel in sigmas, shape (s, c)."""
    robot, x, d = problem.robot, x[ticks], x.shape[1]
    with_a, a_by_state = _with_accelerations(problem, x, calibration, ticks) if robot.accelerometers else (x, x)
    with_u = np.hstack([x, np.zeros((len(x), robot.n))])  # currents are linear: their slopes ask for no command
    found = []
    for name, sensor in robot.sensors.items():
        factor = factor_on_state(robot, name, np.zeros((len(x), len(sensor.channels))), np.zeros(len(x)))
        behind = feels(sensor)
        at = {ACCELERATION: with_a, COMMAND: with_u}.get(behind, x)
        J = factor.linearize((at,), calibration).by_state[0] / sensor.sigmas[:, None]
        if behind == ACCELERATION:
            J = J[:, :, :d] + J[:, :, d:] @ a_by_state
        J = J[:, :, :d]
        found.append(np.einsum("kri,kij,krj->kr", J, P, J, optimize=True) + 1.0)
    return np.hstack(found)


def _with_accelerations(
    problem: BagProblem, x: Array, calibration: Calibration, ticks: NDArray[np.intp]
) -> tuple[Array, Array]:
    """States with link accelerations behind them, and the derivatives of these by the states, (s, n_link, d)."""
    model, parameters = problem.dynamics.model, calibration.values
    u = problem.dynamics.select(ticks).command(parameters)
    found, n = model.with_derivatives(x, u, parameters), model.layout.n_link
    return np.hstack([x, found.value[:, :n]]), found.by_state[:, :n]
