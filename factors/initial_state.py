# SPDX-License-Identifier: BSD-3-Clause
"""Initial state, eq. (30) of Schuethe, Wenk, Frese (2016): the robot starts at rest, links near their motors.

    residual = (q_link - q_motor, v_link, v_motor) of the first state

Variables: X(0). The paper compares q_link with the first encoder sample; the motor position itself is the same up
to one encoder sigma, a thousandth of the tolerance, and needs no sample at the first tick.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Linearization, Samples

Array = NDArray[np.float64]


@dataclass(frozen=True)
class InitialStateFactor:
    """Prior on deflection and velocities of the first state.

    Attributes:
        joints: names of the joints.
        deflection_sigma: tolerance of q_link - q_motor [rad].
        velocity_sigma: tolerance of the velocities [rad/s].
    """

    joints: tuple[str, ...]
    deflection_sigma: float
    velocity_sigma: float

    name = "initial_state"
    states = 1
    blocks = ()

    def __len__(self) -> int:
        return 1

    @property
    def rows(self) -> tuple[str, ...]:
        """Names of the rows."""
        parts = ("deflection", "link_velocity", "motor_velocity")
        return tuple(f"{joint}.initial_{part}" for part in parts for joint in self.joints)

    @property
    def sigmas(self) -> Array:
        """Tolerances, shape (3n,)."""
        n = len(self.joints)
        return np.concatenate([np.full(n, self.deflection_sigma), np.full(2 * n, self.velocity_sigma)])

    @property
    def _matrix(self) -> Array:
        eye, zero = np.eye(len(self.joints)), np.zeros((len(self.joints),) * 2)
        return np.block([[eye, zero, -eye, zero], [zero, eye, zero, zero], [zero, zero, zero, eye]])

    def select(self, samples: Samples) -> InitialStateFactor:
        """There is one sample only."""
        return self

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Deflections and velocities, shape (1, 3n)."""
        return x[0] @ self._matrix.T

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and its constant derivative."""
        return Linearization(self.residual(x, calibration), (self._matrix[None],))
