# SPDX-License-Identifier: BSD-3-Clause
"""Initial state, eq. (30) of Schuethe, Wenk, Frese (2016): the robot starts at rest, links near their motors.

    residual = (q_link - q_motor, v_link, v_motor) of the first state

Variables: X(0). The paper compares q_link with the first encoder sample; the motor position itself is the same up
to one encoder sigma, a thousandth of the tolerance, and needs no sample at the first tick.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Linearization, Samples
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class InitialStateFactor:
    """Prior on deflections, velocities and memories of the first state.

    Attributes:
        layout: of the states.
        deflection_sigma: tolerance of q_link - q_motor, and of the tilt of a bearing [rad].
        velocity_sigma: tolerance of the velocities [rad/s].
        memory_sigmas: tolerance of each memory, shape (n_memory,).
        A: link angles as the motors see them, shape (n, n); None for the links' own.
    """

    layout: StateLayout
    deflection_sigma: float
    velocity_sigma: float
    memory_sigmas: tuple[float, ...] = ()
    A: Array | None = None

    name = "initial_state"
    states = 1
    blocks = ()

    def __len__(self) -> int:
        return 1

    @property
    def rows(self) -> tuple[str, ...]:
        """Names of the rows."""
        layout = self.layout
        deflections = [f"{name}.initial_deflection" for name in (*layout.motors, *self._hinges)]
        velocities = [f"{name}.initial_link_velocity" for name in layout.links]
        velocities += [f"{name}.initial_motor_velocity" for name in layout.motors]
        return (*deflections, *velocities, *(f"{name}.initial" for name in layout.memories))

    @property
    def sigmas(self) -> Array:
        """Tolerances, shape (r,)."""
        deflections = np.full(len(self.layout.motors) + len(self._hinges), self.deflection_sigma)
        velocities = np.full(len(self.layout.velocities), self.velocity_sigma)
        return np.concatenate([deflections, velocities, self.memory_sigmas])

    @property
    def _hinges(self) -> list[str]:
        return [name for name in self.layout.links if name not in self.layout.joints]

    @property
    def _matrix(self) -> Array:
        layout, eye = self.layout, np.eye(self.layout.size)
        elastic = [layout.joints.index(joint) for joint in layout.motors]
        hinges = [layout.links.index(name) for name in self._hinges]
        links = eye[layout.joint_q] if self.A is None else self.A @ eye[layout.joint_q]
        deflections = links[elastic] - eye[layout.motor_q[elastic]]
        return np.vstack([deflections, eye[hinges], eye[layout.rates]])

    def with_lasting(self, sigmas: Array) -> InitialStateFactor:
        """The same with other tolerances of the last memories, the torques that last, shape (k,)."""
        own = self.memory_sigmas[: len(self.memory_sigmas) - len(sigmas)]
        return replace(self, memory_sigmas=(*own, *sigmas.tolist()))

    def select(self, samples: Samples) -> InitialStateFactor:
        """There is one sample only."""
        return self

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Deflections, velocities and memories, shape (1, r)."""
        return x[0] @ self._matrix.T

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and its constant derivative."""
        return Linearization(self.residual(x, calibration), (self._matrix[None],))
