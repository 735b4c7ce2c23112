# SPDX-License-Identifier: BSD-3-Clause
"""One Levenberg-Marquardt step of a condensed graph, by GTSAM's linear algebra.

GTSAM linearises the graph, eliminates the states between stretches, substitutes back, and retracts. Only the damping is
not that of `gtsam.LevenbergMarquardtOptimizer`, which damps states and shared values alike: here the states are left
free to follow the shared values, as long valleys are walked in tiny steps otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import gtsam
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from jointscope.factors.calibration import Calibration
from jointscope.graphs.solving.condensed_graph import CondensedGraph
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.graphs.solving.unobservable import unobservable
from jointscope.robots.errors import SolveError

Array = NDArray[np.float64]

LARGEST = 1e8  # damping of the shared values beyond which nothing is tried


@dataclass(frozen=True)
class DampedStep:
    """Where a step leads, and the largest change of a shared value in its sigmas."""

    values: gtsam.Values
    in_sigmas: float


def damped_step(graph: CondensedGraph, values: gtsam.Values, damping: float, bends: Sequence[Array] = ()) -> DampedStep:
    """A step from some values, not checked against the cost.

    Args:
        graph: the recordings.
        values: where it begins.
        damping: of the shared values, relative to the diagonal of their Hessian.
        bends: further damping of the states of each piece, shape (m,).

    Raises:
        SolveError: a state or a shared value that nothing determines, or a Hessian that is not finite.
    """
    linear = graph.linearized(values, damping_of_states(damping), bends)
    try:
        conditionals, rest = linear.eliminatePartialSequential(graph.states_ordering)
    except RuntimeError:
        return _dense_step(graph, values, linear, damping)
    block, right = rest.hessian(graph.shared_ordering) if graph.shared_keys else (np.zeros((0, 0)), np.zeros(0))
    given, in_sigmas = _shared_step(graph, block, np.ravel(right), damping)
    return DampedStep(values.retract(conditionals.optimize(given)), in_sigmas)


def _dense_step(
    graph: CondensedGraph, values: gtsam.Values, linear: gtsam.GaussianFactorGraph, damping: float
) -> DampedStep:
    """The same step where GTSAM refuses to eliminate a state that is known, but weakly.

    GTSAM calls a state indeterminate where one of its values is known 2^12 times worse beside the others than if those
    were given. The speed of a joint that sticks at the beginning is such a one: friction forgets it before a slow
    encoder reads again. Twice as many digits are there.
    """
    states = [graph.states_ordering.at(i) for i in range(graph.states_ordering.size())]
    ordering = gtsam.Ordering(graph.states_ordering)
    for key, _ in graph.shared_keys:
        ordering.push_back(key)
    H, right = linear.hessian(ordering)
    right, ends = np.ravel(right), np.cumsum([values.atVector(key).size for key in states])
    inner = int(ends[-1])
    scale = 1.0 / np.sqrt(np.maximum(np.diag(H)[:inner], np.finfo(float).tiny))
    try:
        factor = cho_factor(H[:inner, :inner] * np.outer(scale, scale))
    except (np.linalg.LinAlgError, ValueError) as err:
        raise SolveError(
            "the states of the recording are not determined: either no sample sees one of them, or the estimate ran "
            "away because the model contradicts the recording"
        ) from err
    # of the states, by a change of the shared values and without one
    by_shared = scale[:, None] * cho_solve(factor, scale[:, None] * H[:inner, inner:])
    alone = scale * cho_solve(factor, scale * right[:inner])
    block = H[inner:, inner:] - H[inner:, :inner] @ by_shared
    step, in_sigmas = _shared_step(graph, block, right[inner:] - H[inner:, :inner] @ alone, damping)
    given = np.concatenate([step.at(key) for key, _ in graph.shared_keys]) if graph.shared_keys else np.zeros(0)
    for key, change in zip(states, np.split(alone - by_shared @ given, ends[:-1]), strict=True):
        step.insert(key, change)
    return DampedStep(values.retract(step), in_sigmas)


def damping_of_states(damping: float) -> float:
    """Damping of the states for one of the shared values: next to none, as long as shorter steps of those may help.

    Damping is relative to the diagonal, and steps of the dynamics know each state a million times better from its
    neighbours than the sensors know the motion: a billionth of that holds a motion fast. Where steps of the shared
    values are next to nothing and the cost still rises, the states are what is too far off.
    """
    return float((damping / LARGEST) ** 1.5)


def shared_step(
    H: Array, g: Array, free: NDArray[np.intp], damping: float, shared: SharedLayout, like: Calibration
) -> tuple[Array, float]:
    """Damped step of all shared values, and its largest part in sigmas.

    Args:
        H: their Hessian with the states eliminated, shape (s, s).
        g: their gradient, shape (s,).
        free: indices of those that may change.
        damping: relative to the diagonal of the Hessian.
        shared: layout of the shared values.
        like: any calibration of the robot; names what is not determined.

    Raises:
        SolveError: a Hessian that is not finite or not positive definite.
    """
    step = np.zeros(len(g))
    if len(free) == 0:
        return step, 0.0
    block = H[np.ix_(free, free)]
    if not (np.all(np.isfinite(block)) and np.all(np.isfinite(g))):
        raise SolveError("the estimate ran away: a Hessian is not finite; the model contradicts the recording")
    try:
        factor = cho_factor(block + damping * np.diag(np.diag(block)))
    except np.linalg.LinAlgError as err:
        raise unobservable(H, free, shared, like) from err
    step[free] = -cho_solve(factor, g[free])
    sigmas = np.sqrt(np.maximum(np.diag(cho_solve(factor, np.eye(len(free)))), 0.0))
    return step, float(np.max(np.abs(step[free]) / sigmas))


def _shared_step(graph: CondensedGraph, block: Array, right: Array, damping: float) -> tuple[gtsam.VectorValues, float]:
    """Step of the shared values from what the states left of the system; its largest part in sigmas."""
    step, keys = gtsam.VectorValues(), graph.shared_keys
    if not keys:
        return step, 0.0
    free = np.concatenate([index for _, index in keys])
    H, g = np.zeros((graph.shared.size, graph.shared.size)), np.zeros(graph.shared.size)
    H[np.ix_(free, free)], g[free] = block, -right
    change, in_sigmas = shared_step(H, g, free, damping, graph.shared, graph.likes[0])
    for key, index in keys:
        step.insert(key, change[index])
    return step, in_sigmas
