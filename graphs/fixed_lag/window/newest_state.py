# SPDX-License-Identifier: BSD-3-Clause
"""Mean and covariance of the newest tick: states of the robot, gyro biases, adapted parameters.

The same linear rows go to the window in GTSAM. Without late samples its marginal of the newest tick is this one to
rounding (a test), and this one costs a fifth; after late samples it is read from the window again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

Array = NDArray[np.float64]


@dataclass
class NewestState:
    """A Gaussian.

    Attributes:
        mean: shape (D,).
        covariance: shape (D, D).
    """

    mean: Array
    covariance: Array

    @property
    def is_possible(self) -> bool:
        """Whether all numbers are finite and no variance is negative."""
        # a sum is finite only if all its terms are
        numbers = float(self.mean.sum()) + float(self.covariance.sum())
        return math.isfinite(numbers) and float(self.covariance.diagonal().min()) >= 0.0

    def predicted(self, mean: Array, F: Array, Q: Array) -> NewestState:
        """After a step, with mean as integrated, transition F and covariance Q of the step, shapes (D,), (D, D)."""
        return NewestState(mean, F @ self.covariance @ F.T + Q)

    def update(self, with_state: Array, S: Array, residual: Array) -> None:
        """Takes in samples.

        Args:
            with_state: covariance of the innovation with the state, shape (r, D).
            S: covariance of the innovation, shape (r, r).
            residual: measured - predicted, shape (r,).
        """
        factor, info = lapack.dpotrf(S, lower=1)
        if info:
            return  # cannot happen with positive sensor noise; the sample is then worth nothing
        K, _ = lapack.dpotrs(factor, with_state, lower=1)
        self.mean = self.mean + residual @ K
        P = self.covariance - with_state.T @ K
        self.covariance = 0.5 * (P + P.T)
