# SPDX-License-Identifier: BSD-3-Clause
"""The prediction error that sensor noise and state uncertainty alone would leave, channel by channel.

An encoder's floor grows with the uncertainty of the motion, a gyro's about an axis that nothing turns about stays at
its noise. See `noise_floor` for the process noise behind it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.bag_problem import BagProblem
from jointscope.graphs.causal_filter import filter_around
from jointscope.graphs.noise_estimation import scaled
from jointscope.graphs.noise_floor import STARTS, _advance, _channel_variances, _quiet_factors, settled_from

Array = NDArray[np.float64]


def channel_floors(problem: BagProblem, x: Array, calibration: Calibration, horizon: float) -> dict[str, float]:
    """Root mean square of the expected error `horizon` seconds ahead, in sensor sigmas, by channel.

    Args:
        problem: the recording with the model's noise.
        x: smoothed states, shape (m, d).
        calibration: shared values.
        horizon: prediction horizon [s].
    """
    quiet = problem.with_noise(scaled(problem.dynamics.steps.noise, _quiet_factors(problem, x, calibration)))
    filtered = filter_around(quiet, x, calibration)
    steps = max(round(horizon / float(np.median(problem.timeline.h))), 1)
    first = int(np.searchsorted(problem.timeline.ticks, settled_from(problem)))
    last = max(len(x) - 2 - steps, 0)
    start = np.unique(np.linspace(min(first, last), last, STARTS).astype(int))
    P = filtered.covariance[start]
    for i in range(min(steps, len(x) - 2)):
        P = _advance(quiet, x, calibration, start + i, P)
    floors = np.sqrt(np.mean(_channel_variances(quiet, x[start + steps], calibration, P), axis=0))
    return dict(zip(problem.robot.channels, map(float, floors), strict=True))
