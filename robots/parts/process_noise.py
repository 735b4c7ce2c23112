# SPDX-License-Identifier: BSD-3-Clause
"""Random torques that a model allows for."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ProcessNoise:
    """Random torques, as the random walk of the velocities that they cause.

    Attributes:
        estimate: whether a calibration estimates the densities.
        model: "integrated" (the positions follow from the velocities) or "independent" (eq. 36).
        link_velocity: density of the torque on each link coordinate over its inertia at zero angles, shape (n_link,)
            [rad/s/sqrt(s)].
        motor_velocity: density of each motor equation, shape (n_motor,) [rad/s/sqrt(s)].
        memory: density of each memory of the state, shape (n_memory,).
        position: density of the positions for model "independent" [rad/sqrt(s)].
        smallest: of link and motor velocities, below which rounding in the Hessian and the integration error take over,
            shape (n_link + n_motor,).
    """

    estimate: bool
    model: str
    link_velocity: Array
    motor_velocity: Array
    position: float = 0.0
    memory: Array = field(default_factory=lambda: np.zeros(0))
    smallest: Array = field(default_factory=lambda: np.array(1e-3))
