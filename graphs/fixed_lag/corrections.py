# SPDX-License-Identifier: BSD-3-Clause
"""What later measurements change about the newest state: its own verdict on its sigma, without any truth.

With the information up to t the state has covariance P, with that up to t + lag it has P_lag. If the model is right,
the difference of the two estimates has covariance P - P_lag, less than P.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.replay_result import StateSeries
from jointscope.robots.robot import Robot

Array = NDArray[np.float64]


def corrections(robot: Robot, states: StateSeries, lagged: StateSeries) -> list[tuple[str, str, Array, Array]]:
    """Newest minus smoothed state at the same instant.

    Returns:
        For deflection, link velocity and motor velocity: name, unit, difference and sigma of the newest state, shapes
        (m, n) at `states.times`; the difference is NaN where there is no smoothed state.
    """
    layout = robot.layout
    link, motor = layout.joint_q, layout.motor_q
    x, s = states.mean, states.sigma
    later = np.full_like(x, np.nan)
    if len(lagged.times):
        t, known = states.times, lagged.times
        inside = (t >= known[0]) & (t <= known[-1])
        later[inside] = np.column_stack([np.interp(t[inside], known, column) for column in lagged.mean.T])
    away = x - later
    return [
        ("deflection", "rad", away[:, link] - away[:, motor], states.deflection_sigma),
        ("v_link", "rad/s", away[:, layout.joint_v], s[:, layout.joint_v]),
        ("v_motor", "rad/s", away[:, layout.motor_v], s[:, layout.motor_v]),
    ]
