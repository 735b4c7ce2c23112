# SPDX-License-Identifier: BSD-3-Clause
"""A factor of the user's own on its way into the window: its keys are ticks, its values the states themselves.

The window counts deviations from nominal states in units of its own. A user's factor sees none of that: it is
linearised once, at whole states, as everything else that enters the window, and its rows are moved to the nominal ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import gtsam
import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.window.past_tick import PastTick
from jointscope.graphs.fixed_lag.window.smoother_window import Rows
from jointscope.graphs.gtsam_solvers.users_factor import what_is_wrong
from jointscope.robots.errors import EstimatorError

Array = NDArray[np.float64]

MOST_STATES = 3  # GTSAM's JacobianFactor takes no more keys from Python


def tick_key(number: int) -> int:
    """GTSAM's key of a tick: X(number)."""
    return gtsam.symbol("x", number)


def ticks_of(factor: gtsam.NonlinearFactor, ticks: Mapping[int, PastTick]) -> list[PastTick]:
    """The ticks that a factor touches.

    Args:
        factor: of the user.
        ticks: those of the window, by number.

    Raises:
        EstimatorError: a key that is no tick of the window, or too many of them.
    """
    oldest, newest = min(ticks), max(ticks)
    window = f"the window holds x{oldest} ({ticks[oldest].time:.3f} s) to x{newest} ({ticks[newest].time:.3f} s)"
    found = []
    for key in factor.keys():
        symbol = gtsam.Symbol(key)
        name = gtsam.DefaultKeyFormatter(key)
        if symbol.chr() != ord("x"):
            raise EstimatorError(f"the factor touches {name}, which the estimator lacks; {window}: use `est.key(t)`")
        if symbol.index() not in ticks:
            when = "has left it" if symbol.index() < oldest else "is not there yet"
            raise EstimatorError(f"the factor touches {name}, which {when}; {window}: use `est.key(t)`")
        found.append(ticks[symbol.index()])
    if not 1 <= len(found) <= MOST_STATES:
        raise EstimatorError(f"the factor touches {len(found)} states; expected one to {MOST_STATES}")
    return found


def rows_of(factor: gtsam.NonlinearFactor, ticks: list[PastTick], estimate: Callable[[PastTick], Array]) -> Rows:
    """Whitened rows of a factor, linearised at the present estimate.

    Args:
        factor: of the user.
        ticks: that it touches, in the order of its keys.
        estimate: state of a tick as the window has it, shape (D,).

    Raises:
        EstimatorError: the factor cannot be evaluated there, or is not finite.
    """
    values, states = gtsam.Values(), [estimate(tick) for tick in ticks]
    for tick, x in zip(ticks, states, strict=True):
        values.insert(tick_key(tick.number), x)
    sizes = {key: len(states[0]) for key in factor.keys()}
    if wrong := what_is_wrong(factor, values, sizes, gtsam.DefaultKeyFormatter):
        raise EstimatorError(
            f"the factor on {', '.join(f'x{t.number}' for t in ticks)} {wrong}; it was left out (a state has "
            f"{len(states[0])} numbers: the robot's layout, then gyro biases)"
        )
    linear = factor.linearize(values)
    A, b = linear.jacobian()
    size, order = len(states[0]), [gtsam.Symbol(key).index() for key in linear.keys()]
    by_number = {tick.number: x - tick.nominal for tick, x in zip(ticks, states, strict=True)}
    parts = tuple(np.asfortranarray(A[:, i * size : (i + 1) * size]) for i in range(len(order)))
    moved = b + sum(part @ by_number[number] for part, number in zip(parts, order, strict=True))
    return Rows(tuple(order), parts, np.ravel(moved))
