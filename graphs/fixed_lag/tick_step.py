# SPDX-License-Identifier: BSD-3-Clause
"""One step of the dynamics from a known state: where it leads, and the linearised dynamics factor of this step.

With f = dx/dt the three rules of the dynamics factors are, for the whole state,

    simpson   r = x1 - x0 - h/6 (f0 + 4 f_mid + f1),   x_mid = (x0 + x1)/2 + h/8 (f0 - f1)
    midpoint  r = x1 - x0 - h f((x0 + x1)/2)
    euler     r = x1 - x0 - h f0

x1 follows from r = 0 by Newton's method, begun with a linearly implicit step; one iteration does unless friction turns
over within the step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.state_rates import StateRates

Array = NDArray[np.float64]

ITERATIONS = 4
SMALL_TURN = 0.05  # change of the argument of the friction's tanh in an iteration that needs no further one


@dataclass(frozen=True)
class TickStep:
    """A step, linearised at its beginning and its end.

    Attributes:
        x1: state at the end, shape (d,).
        by_start: R0 = dr/dx0, shape (d, d).
        by_end_inverse: (dr/dx1)^-1, shape (d, d).
        by_end: R1 = dr/dx1, shape (d, d).
        by_torque: -dr/dtau of the torque of each motor, shape (d, n).
    """

    x1: Array
    by_start: Array
    by_end: Array
    by_end_inverse: Array
    by_torque: Array

    @property
    def transition(self) -> Array:
        """F = dx1/dx0, shape (d, d)."""
        return -self.by_end_inverse @ self.by_start


def take_step(model: StateRates, rule: str, x0: Array, torque: Array, h: float) -> TickStep:
    """Integrates over one step.

    Args:
        model: rates of the state.
        rule: "simpson", "midpoint" or "euler".
        x0: state at the beginning, shape (d,).
        torque: mean torque of the commands over the step, shape (n,) [N m].
        h: length of the step [s].
    """
    f0, A0, C0 = model.with_jacobian(x0, torque)
    if rule == "euler":
        eye = np.eye(len(x0))
        return TickStep(x0 + h * f0, -eye - h * A0, eye, eye, h * C0)
    defect = _simpson if rule == "simpson" else _midpoint
    x1 = x0 + np.linalg.solve(np.eye(len(x0)) - 0.5 * h * A0, h * f0)
    columns = model.friction_columns
    for _ in range(ITERATIONS):
        r, R0, R1 = defect(model, x0, x1, torque, h, f0, A0)
        inverse = np.linalg.inv(R1)
        change = inverse @ r
        x1 = x1 - change
        if np.abs(change[columns]).max() * model.sharpness < SMALL_TURN:
            break
    return TickStep(x1, R0, R1, inverse, h * C0)


Defect = Callable[[StateRates, Array, Array, Array, float, Array, Array], tuple[Array, Array, Array]]


def _simpson(
    model: StateRates, x0: Array, x1: Array, torque: Array, h: float, f0: Array, A0: Array
) -> tuple[Array, Array, Array]:
    f1, A1, _ = model.with_jacobian(x1, torque)
    f_mid, A_mid, _ = model.with_jacobian(0.5 * (x0 + x1) + h / 8.0 * (f0 - f1), torque)
    eye, sixth = np.eye(len(x0)), h / 6.0
    r = x1 - x0 - sixth * (f0 + 4.0 * f_mid + f1)
    R0 = -eye - sixth * (A0 + A_mid @ (2.0 * eye + 0.5 * h * A0))
    R1 = eye - sixth * (A1 + A_mid @ (2.0 * eye - 0.5 * h * A1))
    return r, R0, R1


def _midpoint(
    model: StateRates, x0: Array, x1: Array, torque: Array, h: float, f0: Array, A0: Array
) -> tuple[Array, Array, Array]:
    f_mid, A_mid, _ = model.with_jacobian(0.5 * (x0 + x1), torque)
    eye, half = np.eye(len(x0)), 0.5 * h * A_mid
    return x1 - x0 - h * f_mid, -eye - half, eye - half
