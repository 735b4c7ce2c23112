# SPDX-License-Identifier: BSD-3-Clause
"""Motors that follow links rigidly, with noise on both sides: the likelihood of total least squares, links eliminated.

    theta = A q + z                     of the k motors whose springs are locked; A are rows of T^-1, z unknown zeros
    q_m = q(t - d) + noise              links' encoders may be late by d
    r = theta_m - A (q_m + d q_m' + d^2 q_m'' / 2) - z    has the covariance  S = D (S_motor + A S_link A^T) D
    cost = sum of r^T S^-1 r / 2        is that of all q at their best values, with its exact gradient

The gradient by A is -S^-1 r q^T, where q are the links at these values. D, at least one, widens what encoders explain
by what residuals repeat.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RigidRows:
    """Residuals at some matrix.

    Attributes:
        r: shape (m, k) [rad].
        W: inverse of S, shape (k, k).
        S: its diagonal is the variance of each residual, shape (k, k) [rad^2].
        q: links as each row sees them at their best values, shape (m, k, n) [rad].
        turned: derivative by d, shape (m, k).
    """

    r: Array
    W: Array
    S: Array
    q: Array
    turned: Array

    @staticmethod
    def of(
        motors: Array, links: tuple[Array, Array, Array], sigmas: tuple[Array, Array], widened: Array,
        A: Array, zero: Array, delay: float,
    ) -> RigidRows:  # fmt: skip
        """Residuals and what their derivatives are made of.

        Args:
            motors: readings, shape (m, k) [rad].
            links: readings [rad], speeds [rad/s] and accelerations [rad/s^2], shape (m, n) each.
            sigmas: of motors (k,) and links (n,) [rad].
            widened: D, shape (k,).
            A: shape (k, n).
            zero: z, shape (k,) [rad].
            delay: d [s].
        """
        readings, speeds, accelerations = links
        y = readings + delay * speeds + 0.5 * delay**2 * accelerations
        r = motors - y @ A.T - zero
        S = np.outer(widened, widened) * (np.diag(sigmas[0] ** 2) + (A * sigmas[1] ** 2) @ A.T)
        W: Array = np.asarray(np.linalg.inv(S), dtype=np.float64)
        shift = ((r @ W) * widened) @ A * sigmas[1] ** 2
        q = y[:, None, :] + widened[:, None] * shift[:, None, :]
        return RigidRows(r, W, S, q, -(speeds + delay * accelerations) @ A.T)

    @property
    def cost(self) -> float:
        """Half the sum of squared whitened residuals."""
        return 0.5 * float(np.einsum("mk,kl,ml->", self.r, self.W, self.r))

    def system(self, J: Array) -> tuple[Array, Array]:
        """Gauss-Newton matrix and gradient of some values, for derivatives of the residuals of shape (m, k, p)."""
        WJ = np.einsum("kl,mlp->mkp", self.W, J)
        p = J.shape[2]
        return J.reshape(-1, p).T @ WJ.reshape(-1, p), np.einsum("mk,mkp->p", self.r, WJ)
