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

from jointscope.graphs.solving.condensed_graph import CondensedGraph
from jointscope.graphs.solving.unobservable import unobservable
from jointscope.robots.errors import SolveError

Array = NDArray[np.float64]

LARGEST = 1e8  # damping of the shared values beyond which nothing is tried
OF_STATES = 1e-9  # damping of the states, as long as shorter steps of the shared values may help


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
        given, in_sigmas = _shared_step(graph, rest, damping)
        return DampedStep(values.retract(conditionals.optimize(given)), in_sigmas)
    except RuntimeError as err:
        raise SolveError(
            "the states of the recording are not determined: either no sample sees one of them, or the estimate ran "
            f"away because the model contradicts the recording ({' '.join(str(err).split())[:120]})"
        ) from err


def damping_of_states(damping: float) -> float:
    """Damping of the states for one of the shared values.

    Where steps of the shared values are next to nothing and the cost still rises, the states are what is too far off.
    """
    return float(max(min(damping, OF_STATES), (damping / LARGEST) ** 1.5))


def _shared_step(
    graph: CondensedGraph, rest: gtsam.GaussianFactorGraph, damping: float
) -> tuple[gtsam.VectorValues, float]:
    """Step of the shared values from the graph that the states left, and its largest part in sigmas."""
    step, keys = gtsam.VectorValues(), graph.shared_keys
    if not keys:
        return step, 0.0
    H, right = rest.hessian(graph.shared_ordering)
    free = np.concatenate([index for _, index in keys])
    if not (np.all(np.isfinite(H)) and np.all(np.isfinite(right))):
        raise SolveError("the estimate ran away: a Hessian is not finite; the model contradicts the recording")
    try:
        factor = cho_factor(H + damping * np.diag(np.diag(H)))
    except np.linalg.LinAlgError as err:
        whole = np.zeros((graph.shared.size, graph.shared.size))
        whole[np.ix_(free, free)] = H
        raise unobservable(whole, free, graph.shared, graph.likes[0]) from err
    change = cho_solve(factor, np.ravel(right))
    sigmas = np.sqrt(np.maximum(np.diag(cho_solve(factor, np.eye(len(change)))), 0.0))
    place = 0
    for key, index in keys:
        step.insert(key, change[place : place + len(index)])
        place += len(index)
    return step, float(np.max(np.abs(change) / sigmas))
