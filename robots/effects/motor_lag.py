# SPDX-License-Identifier: BSD-3-Clause
"""The torque follows the command with a time constant."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.effect_kinds.effect import Card, EffectParameter

Array = NDArray[np.float64]
FORGOTTEN = 1e-18  # share of an old value below which it changes nothing


def law(edges: Array, commands: Array, p: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
    """Mean over each step of the response of T y' = u - y to the held command; y starts at the first command.

    With the distance e = y - u at the start of a step of length h and a = exp(-h/T), the mean is u + e (T/h) (1 - a)
    and the next distance e a + u - u_next. Exact for steps of any length.
    """
    T, h = p["time_constant"], np.diff(edges)
    jump = -np.diff(commands, prepend=commands[:1])
    if T <= 0.0:
        return commands.copy(), {"time_constant": jump / h}
    a = np.exp(-h / T)
    a_by_T = a * h / T**2
    share, share_by_T = T / h * (1.0 - a), (1.0 - a) / h - a / T
    distance = _recursion(a, jump)
    distance_by_T = _recursion(a, np.append(0.0, a_by_T[:-1] * distance[:-1]))
    return commands + distance * share, {"time_constant": distance_by_T * share + distance * share_by_T}


def _recursion(a: Array, b: Array) -> Array:
    """x_0 = b_0, x_k = a_(k-1) x_(k-1) + b_k by doubling: after i rounds x_k holds its last 2^i terms, shape (m,)."""
    x, factor = b.copy(), np.append(0.0, a[:-1])
    reach = 1
    while reach < len(x) and np.any(factor > FORGOTTEN):
        x[reach:] += factor[reach:] * x[:-reach]
        factor[reach:] *= factor[:-reach]
        factor[:reach] = 0.0
        reach *= 2
    return x


EFFECT = CommandEffect(
    id="motor_lag",
    owners=("joint", "robot"),
    law=law,
    parameters=(EffectParameter("time_constant", "s", start=2e-3, prior_sigma=6e-3, sign="+", logarithmic=True),),
    example={"time_constant": 5e-3},
    card=Card(
        title="torque lags behind the command",
        law="T du_acting/dt = u - u_acting, with T = time_constant",
        explanation="The current of a motor builds up through its inductance, and filters smooth the command: the "
        "torque follows with a time constant.",
        source="Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, section on actuator dynamics: the "
        "electrical time constant L/R",
        typical="0.5 to 10 ms",
        excitation="steps and chirps of the command, faster than the time constant",
        look_alikes={
            "command_delay": "they agree to first order; only steps of the command at a high rate tell them apart",
            "encoder_delay": "with the encoder late, motion seems to lag behind the command",
            "clock_offset": "stamps that are late against the commands look like a late command",
            "integration_error": "Euler's rule shifts the motion by half a step",
        },
    ),
)
