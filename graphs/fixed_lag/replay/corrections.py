# SPDX-License-Identifier: BSD-3-Clause
"""What later measurements change about the newest state: its own verdict on its sigma, without any truth.

With the information up to t the state has covariance P, with that up to t + lag it has P_lag. If the model is right,
the difference of the two estimates has covariance P - P_lag, less than P.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.replay.replay_result import StateSeries
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Correction:
    """Newest minus smoothed of one quantity of all joints.

    Attributes:
        name: of the quantity.
        unit: its SI unit at joints that turn.
        times: instants that both tell of, shape (m,) [s].
        difference: shape (m, n).
        sigma: of the newest state, shape (m, n).
    """

    name: str
    unit: str
    times: Array
    difference: Array
    sigma: Array


def corrections(robot: Robot, states: StateSeries, lagged: StateSeries) -> list[Correction]:
    """Deflection, link velocity and motor velocity at the times of the smoothed states."""
    layout, t = robot.layout, lagged.times
    link, motor = layout.joint_q, layout.motor_q

    def at_lagged(values: Array) -> Array:
        """Newest values at these times: exact where every tick is kept, linear in between where they were thinned."""
        if not len(t):
            return values[:0]
        return np.column_stack([np.interp(t, states.times, column) for column in values.T])

    away, sigma = at_lagged(states.mean) - lagged.mean, at_lagged(states.sigma)
    v, w = layout.joint_v, layout.motor_v
    return [
        Correction("deflection", "rad", t, away[:, link] - away[:, motor], at_lagged(states.deflection_sigma)),
        Correction("v_link", "rad/s", t, away[:, v], sigma[:, v]),
        Correction("v_motor", "rad/s", t, away[:, w], sigma[:, w]),
    ]
