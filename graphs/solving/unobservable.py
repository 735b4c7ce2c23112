# SPDX-License-Identifier: BSD-3-Clause
"""Which shared values a singular Hessian leaves open, said in an error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.robots.errors import SolveError

Array = NDArray[np.float64]

INVOLVED = 0.3  # of the largest weight in the weakest direction
MOST = 4
TINY = 1e-300


def unobservable(H: Array, free: NDArray[np.intp], shared: SharedLayout, calibration: Calibration) -> SolveError:
    """The error to raise where a Hessian is not positive definite.

    Args:
        H: Hessian on all shared values, shape (s, s).
        free: indices of those that may change.
        shared: layout of the shared values.
        calibration: of any recording.
    """
    block = H[np.ix_(free, free)]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(block), TINY))
    weights = np.abs(np.linalg.eigh(block * scale[:, None] * scale)[1][:, 0])
    order = [i for i in np.argsort(-weights) if weights[i] > INVOLVED * weights.max()]
    names = value_names(shared, calibration)
    involved = list(dict.fromkeys(names[free[i]] for i in order))[:MOST]
    return SolveError(
        f"the recordings do not determine {', '.join(involved)}: their Hessian is not positive definite; add a "
        "recording in which more moves, or give them a narrower prior_sigma, or `fixed: true`, in the robot file"
    )


def value_names(shared: SharedLayout, calibration: Calibration) -> list[str]:
    """Name of every shared value, shape (s,): parameters by their own, else their block's."""
    names = [""] * shared.size
    for places in shared.places:
        for block, place in places.items():
            for k, i in enumerate(range(place.start, place.stop)):
                names[i] = calibration.names[k] if block == DYNAMICS else block.replace(".rotation", ".R_imu_body")
    return names
