# SPDX-License-Identifier: BSD-3-Clause
"""Do the states at the lag agree with those of the batch smoother, which has seen the whole recording?

Both use the same model and the same noise. The batch knows what came later, so they differ; if both are right, the
difference has the variance P_lag - P_batch, less than P_lag. Its root mean square in units of the sigma at the lag is
therefore below one for every state.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration, rotation_block
from jointscope.factors.interpolated import interpolate
from jointscope.graphs.comparison.compare import smooth
from jointscope.graphs.fixed_lag.window.state_names import state_names
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.reversals import times_of_reversals
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.state_layout import StateLayout
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

LARGEST_RMS = 1.0  # [sigma] of any state
FAR = 3.0  # [sigma]
LARGEST_SHARE = 0.01  # of the ticks at which a state may be further away than FAR
ROUNDS = 2  # of steps divided at edges of dead zones, which move with the states
PERIOD = 0.05  # [s] gaps between ticks over which the batch states are not interpolated


@dataclass(frozen=True)
class BatchAgreement:
    """Lagged states against the batch.

    Attributes:
        names: of the states.
        times: shape (m,) [s].
        difference: lagged - batch, shape (m, d) [rad], [rad/s].
        in_sigmas: the same over the sigma at the lag, shape (m, d).
        rms: root mean square of `in_sigmas` over time, shape (d,).
        far_share: share of the ticks further than FAR sigmas away, shape (d,).
        batch: smoothed states of the batch, shape (m, d).
    """

    names: tuple[str, ...]
    times: Array
    difference: Array
    in_sigmas: Array
    rms: Array
    far_share: Array
    batch: Array

    @property
    def agrees(self) -> bool:
        """Whether every state is within its sigma in the mean and rarely far from the batch."""
        return bool(np.all(self.rms <= LARGEST_RMS) and np.all(self.far_share <= LARGEST_SHARE))

    @property
    def worst(self) -> tuple[str, float, float]:
        """State, time [s] and distance [sigma] where they differ most."""
        size = np.nan_to_num(np.abs(self.in_sigmas))
        k, i = np.unravel_index(int(np.argmax(size)), size.shape)
        return self.names[i], float(self.times[k]), float(size[k, i])

    @property
    def apart(self) -> dict[str, float]:
        """States that do not agree and the root mean square of their distance [sigma], the worst first."""
        bad = (self.rms > LARGEST_RMS) | (self.far_share > LARGEST_SHARE)
        found = {name: float(r) for name, r, odd in zip(self.names, self.rms, bad, strict=True) if odd}
        return dict(sorted(found.items(), key=lambda item: -item[1]))

    def to_json(self) -> dict[str, Any]:
        """For machines."""
        name, time, sigmas = self.worst
        return {
            "agrees": self.agrees,
            "rms_in_sigmas": dict(zip(self.names, self.rms.tolist(), strict=True)),
            "beyond_3_sigma": dict(zip(self.names, self.far_share.tolist(), strict=True)),
            "worst": {"state": name, "time": time, "sigmas": sigmas},
        }


def batch_agreement(
    robot: Robot, recording: Recording, times: Array, mean: Array, sigma: Array, later: float = 0.0
) -> BatchAgreement:
    """Runs the batch smoother and compares.

    Args:
        robot: the model of the replay; its noise is taken as it is.
        recording: the same recording, whole.
        times: of the lagged states, shape (m,) [s].
        mean: lagged states, shape (m, d).
        sigma: their standard deviations, shape (m, d); times without them (NaN) are left out.
        later: how much later time zero of `times` is than that of the recording [s].

    Raises:
        RecordingError, SolveError: the batch smoother cannot work on this recording.
    """
    fixed = replace(robot, noise=replace(robot.noise, estimate=False))
    ticks, x = _smoothed(fixed, _finite(recording))
    at = np.asarray(times + later)
    inside = (at >= ticks[0] - 1e-9) & (at <= ticks[-1] + 1e-9) & _near(ticks, at) & np.all(np.isfinite(sigma), axis=1)
    batch = _between(robot.layout, ticks, x, at[inside])
    difference = mean[inside] - batch
    with np.errstate(invalid="ignore", divide="ignore"):
        in_sigmas = np.where(sigma[inside] > 0.0, difference / sigma[inside], 0.0)
    known = np.nan_to_num(in_sigmas)
    return BatchAgreement(
        names=state_names(robot.layout),
        times=times[inside],
        difference=difference,
        in_sigmas=in_sigmas,
        rms=np.sqrt(np.mean(known**2, axis=0)) if len(known) else np.zeros(mean.shape[1]),
        far_share=np.mean(np.abs(known) > FAR, axis=0) if len(known) else np.zeros(mean.shape[1]),
        batch=batch,
    )


def _finite(recording: Recording) -> Recording:
    """The recording without samples that hold NaN or infinity, which the estimator leaves out, too."""
    streams = {}
    for name, s in recording.streams.items():
        good = np.asarray(np.isfinite(s.values).all(axis=1))
        streams[name] = s.take(good)
    return replace(recording, streams=streams)


@in_solver_context
def _smoothed(robot: Robot, recording: Recording) -> tuple[Array, Array]:
    """Times, shape (k,), and states, shape (k, d), of the batch smoother."""
    problem, states, _ = _with_short_reversals(*smooth(robot, recording))
    return problem.timeline.ticks, states


def _between(layout: StateLayout, ticks: Array, x: Array, at: Array) -> Array:
    """States between ticks, shape (m, d), on the most likely motion: a chord is off by a h^2 / 8, some sigmas."""
    step = np.clip(np.searchsorted(ticks, at, side="right") - 1, 0, len(ticks) - 2)
    h = np.diff(ticks)[step]
    return np.asarray(interpolate(layout, x[step], x[step + 1], np.clip((at - ticks[step]) / h, 0.0, 1.0), h))


def _near(ticks: Array, at: Array) -> NDArray[np.bool_]:
    """Whether a batch tick is close to each time."""
    right = np.clip(np.searchsorted(ticks, at), 1, len(ticks) - 1)
    return np.minimum(np.abs(ticks[right] - at), np.abs(at - ticks[right - 1])) < PERIOD


def _with_short_reversals(
    problem: BagProblem, x: Array, calibration: Calibration
) -> tuple[BagProblem, Array, Calibration]:
    """The smoothed problem with its steps divided, solved again; shapes as in `smooth`.

    They are divided where dry friction turns over, and where springs meet edges of dead zones.

    Args:
        problem: smoothed.
        x: its states, shape (m + 1, d).
        calibration: its values; parameters and mountings stay.
    """
    robot = problem.robot
    if robot.choices.integrator != "simpson":
        return problem, x, calibration
    hold = (DYNAMICS, *(rotation_block(gyro.name) for gyro in robot.gyros))
    turning = times_of_reversals(robot, problem.timeline.ticks, x)
    for _ in range(ROUNDS):
        edged, start = problem.divided(x, {})
        known = [times for times in (problem.between, edged.between) if times is not None]
        between = np.unique(np.concatenate([turning, *known]))
        if len(between) == (0 if problem.between is None else len(problem.between)):
            break
        problem, start = edged.divided_at(between, start)
        estimate = solve([problem], Estimate((start,), (calibration,)), hold=hold).estimate
        x, calibration = estimate.states[0], estimate.calibrations[0]
    return problem, x, calibration
