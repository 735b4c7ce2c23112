# SPDX-License-Identifier: BSD-3-Clause
"""One step of the dynamics from a known state: where it leads, and the linearised dynamics factor of this step.

With f = dx/dt the three rules of the dynamics factors are, for the whole state,

    simpson   r = x1 - x0 - h/6 (f0 + 4 f_mid + f1),   x_mid = (x0 + x1)/2 + h/8 (f0 - f1)
    midpoint  r = x1 - x0 - h f((x0 + x1)/2)
    euler     r = x1 - x0 - h f0

x1 follows from r = 0 by Newton's method, begun with the step that leaves no defect where f is linear; one iteration
does unless friction turns over within the step. Where dry friction changes its sign within a part of a step, the rules
miss its torque over up to a sixth of it: a step of the first rule is halved again and again around the change.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from jointscope.graphs.problem.reversals import HALVINGS, turns_sharply
from jointscope.robots.dynamics.state_rates import StateRates
from jointscope.robots.model.encoder_plays import EncoderPlays

Array = NDArray[np.float64]

ITERATIONS = 4
SAME_FRICTION = 1e-3  # share of the Coulomb torque that a straight line may miss before rates are evaluated anew
SAME_DERIVATIVE = 0.05  # largest change of h df/dx over a step whose middle is not evaluated
FARTHEST = 1e5  # [rad, rad/s, m, m/s] by which no robot changes within a step; torques that do are no torques
SMALL_TURN = 0.05  # change of the argument of the friction's tanh in an iteration that needs no further one


@dataclass(frozen=True)
class RatesAt:
    """dx/dt at a state and a torque, with derivatives.

    Attributes:
        x: state, shape (d,).
        torque: of the commands, shape (n,) [N m].
        f: dx/dt, shape (d,).
        A: its derivative by the state, shape (d, d).
        C: its derivative by the torque of each motor, shape (d, n).
        sharpness: of dry friction there, shape (n,) [s/rad].
    """

    x: Array
    torque: Array
    f: Array
    A: Array
    C: Array
    sharpness: Array

    @staticmethod
    def of(model: StateRates, x: Array, torque: Array) -> RatesAt:
        """Evaluated there."""
        return RatesAt(x, torque, *model.with_jacobian(x, torque), model.sharpness.copy())

    def near(self, model: StateRates, x: Array, torque: Array) -> RatesAt:
        """At a state so near that derivatives stay; evaluated anew where friction says that it is not."""
        columns = model.friction_columns
        k0, k1 = self.sharpness.tolist(), model.sharpness.tolist()
        for was_k, k, before, after in zip(k0, k1, self.x[columns].tolist(), x[columns].tolist(), strict=True):
            was = math.tanh(was_k * before)
            straight = (1.0 - was * was) * was_k * (after - before)
            if abs(math.tanh(k * after) - was - straight) > SAME_FRICTION:
                return RatesAt.of(model, x, torque)
        moved = x - self.x
        return RatesAt(
            x, torque, self.f + self.A @ moved + self.C @ (torque - self.torque), self.A, self.C, self.sharpness
        )


@dataclass(frozen=True)
class TickStep:
    """A step, linearised at its beginning and its end.

    Attributes:
        x1: state at the end, shape (d,).
        by_start: R0 = dr/dx0, shape (d, d).
        by_end_inverse: (dr/dx1)^-1, shape (d, d).
        by_end: R1 = dr/dx1, shape (d, d).
        by_torque: -dr/dtau of the torque of each motor, shape (d, n).
        end: rates where the end was linearised; None where the rule does not look there.
    """

    x1: Array
    by_start: Array
    by_end: Array
    by_end_inverse: Array
    by_torque: Array
    end: RatesAt | None

    @property
    def transition(self) -> Array:
        """F = dx1/dx0, shape (d, d)."""
        return -self.by_end_inverse @ self.by_start

    def then(self, second: TickStep) -> TickStep:
        """This step and one from its end as a single step, whose defect is weighed as at the end of the second."""
        F = second.transition
        by_torque = second.by_torque + second.by_end @ F @ self.by_end_inverse @ self.by_torque
        by_start = -second.by_end @ F @ self.transition
        return TickStep(second.x1, by_start, second.by_end, second.by_end_inverse, by_torque, second.end)


def take_step(
    model: StateRates, rule: str, x0: Array, torque: Array, h: float, before: RatesAt | None = None
) -> TickStep:
    """Integrates over one step.

    Args:
        model: rates of the state.
        rule: "simpson", "midpoint" or "euler".
        x0: state at the beginning, shape (d,).
        torque: mean torque of the commands over the step, shape (n,) [N m].
        h: length of the step [s].
        before: rates near the beginning, if they are known.
    """
    step = _halved(model, rule, x0, torque, h, before, HALVINGS if rule == "simpson" else 0)
    return step if model.plays is None else _with_lags(model, model.plays, x0, step)


def _halved(
    model: StateRates, rule: str, x0: Array, torque: Array, h: float, before: RatesAt | None, halvings: int
) -> TickStep:
    """One step, or two of half its length where dry friction turns over sharply."""
    step = undivided_step(model, rule, x0, torque, h, before)
    turning = model.friction_columns
    if halvings == 0 or not turns_sharply(x0[turning], step.x1[turning], model.sharpness).any():
        return step
    first = _halved(model, rule, x0, torque, 0.5 * h, before, halvings - 1)
    return first.then(_halved(model, rule, first.x1, torque, 0.5 * h, first.end, halvings - 1))


def undivided_step(
    model: StateRates, rule: str, x0: Array, torque: Array, h: float, before: RatesAt | None = None
) -> TickStep:
    """The step that leaves the dynamics factor of its rule no defect; arguments as of `take_step`."""
    start = RatesAt.of(model, x0, torque) if before is None else before.near(model, x0, torque)
    eye, columns = _eye(len(x0)), model.friction_columns
    if rule == "euler":
        x1 = x0 + h * start.f
        return TickStep(x1, -eye - h * start.A, eye, eye, h * start.C, None) if _near(x0, x1) else _lost(x0, start.C)
    defect = _simpson if rule == "simpson" else _midpoint
    half = 0.5 * h * start.A
    first = eye - half + half @ half / 3.0 if rule == "simpson" else eye - half
    x1 = x0 + lapack.dgesv(first, h * start.f)[2]
    for _ in range(ITERATIONS):
        if not _near(x0, x1):
            return _lost(x0, start.C)
        r, R0, R1, end = defect(model, start, x1, h)
        inverse = lapack.dgesv(R1, eye)[2]
        change = inverse @ r
        x1 = x1 - change
        if np.abs(model.sharpness * change[columns]).max() < SMALL_TURN:
            break
    return TickStep(x1, R0, R1, inverse, h * start.C, end)


def _with_lags(model: StateRates, plays: EncoderPlays, x0: Array, step: TickStep) -> TickStep:
    """The step with the lags of encoders, which follow the positions at its two ends; their rows are the last."""
    after, inside, _ = plays.with_slopes(x0, step.x1, model.play_sizes)
    x1, R0, R1, inverse = step.x1.copy(), step.by_start.copy(), step.by_end.copy(), step.by_end_inverse.copy()
    for i, (lag, q) in enumerate(zip(plays.lags, plays.positions, strict=True)):
        x1[lag] = after[i]
        R0[lag], R1[lag] = 0.0, 0.0
        R0[lag, lag], R0[lag, q] = -inside[i], inside[i]
        R1[lag, lag], R1[lag, q] = 1.0, -inside[i]
        inverse[lag] = inside[i] * inverse[q]
        inverse[lag, lag] = 1.0
    return TickStep(x1, R0, R1, inverse, step.by_torque, step.end)


def _simpson(model: StateRates, start: RatesAt, x1: Array, h: float) -> tuple[Array, Array, Array, RatesAt | None]:
    """Defect, its derivatives by beginning and end, and the rates at the end."""
    x0, torque, end = start.x, start.torque, RatesAt.of(model, x1, start.torque)
    middle = 0.5 * (x0 + x1) + h / 8.0 * (start.f - end.f)
    if _is_smooth(model, start, end, h):
        f_mid, A_mid = model.rates(middle, torque), 0.5 * (start.A + end.A)
    else:
        f_mid, A_mid, _ = model.with_jacobian(middle, torque)
    eye, sixth = _eye(len(x0)), h / 6.0
    r = x1 - x0 - sixth * (start.f + 4.0 * f_mid + end.f)
    twice = 2.0 * A_mid
    R0 = -eye - sixth * (start.A + twice + 0.5 * h * A_mid @ start.A)
    R1 = eye - sixth * (end.A + twice - 0.5 * h * A_mid @ end.A)
    return r, R0, R1, end


def _is_smooth(model: StateRates, start: RatesAt, end: RatesAt, h: float) -> bool:
    """Whether the derivative in the middle of a step is the mean of those at its ends."""
    columns = model.friction_columns
    if model.has_kinks or not (start.x[columns] * end.x[columns] > 0.0).all():
        return False  # a spring may have a kink, friction turns over
    return bool(np.abs(end.A - start.A).max() * h < SAME_DERIVATIVE)


def _midpoint(model: StateRates, start: RatesAt, x1: Array, h: float) -> tuple[Array, Array, Array, RatesAt | None]:
    """As `_simpson`."""
    f_mid, A_mid, _ = model.with_jacobian(0.5 * (start.x + x1), start.torque)
    eye, half = _eye(len(x1)), 0.5 * h * A_mid
    return x1 - start.x - h * f_mid, -eye - half, eye - half, None


def _near(x0: Array, x1: Array) -> bool:
    return bool(np.abs(x1 - x0).max() < FARTHEST)


def _lost(x0: Array, by_torque: Array) -> TickStep:
    """A step that leads nowhere: what comes of it is no number, quietly, and never an overflow further on."""
    nowhere = np.full((len(x0), len(x0)), np.nan)
    return TickStep(nowhere[0], nowhere, nowhere, nowhere, np.full_like(by_torque, np.nan), None)


@cache
def _eye(size: int) -> Array:
    return np.eye(size)
