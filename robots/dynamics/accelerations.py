# SPDX-License-Identifier: BSD-3-Clause
"""Accelerations of many samples with their derivatives, as the equations of motion give them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RigidDerivatives:
    """Derivatives of the rigid bodies' accelerations by q, v and tau (M^-1), shape (m, n_link, n_link) each."""

    by_position: Array
    by_velocity: Array
    by_torque: Array

    def between(self) -> RigidDerivatives:
        """Means of neighbouring samples, shape (m - 1, ...): off by h^2/8 of their second time derivative."""
        parts = (self.by_position, self.by_velocity, self.by_torque)
        return RigidDerivatives(*(0.5 * (part[1:] + part[:-1]) for part in parts))


@dataclass(frozen=True)
class Accelerations:
    """Accelerations of m samples and their derivatives.

    Attributes:
        value: link accelerations, motor accelerations, rates of memories, shape (m, r) [rad/s^2].
        by_state: derivative by x, shape (m, r, d).
        by_parameter: derivative by the free parameters, each in its own unit, shape (m, r, p).
        rigid: the part of the derivatives that comes from the rigid bodies.
    """

    value: Array
    by_state: Array
    by_parameter: Array
    rigid: RigidDerivatives

    def part(self, samples: slice) -> Accelerations:
        """Those of some samples; `rigid` stays that of all."""
        return Accelerations(self.value[samples], self.by_state[samples], self.by_parameter[samples], self.rigid)
