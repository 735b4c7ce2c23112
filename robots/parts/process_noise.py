# SPDX-License-Identifier: BSD-3-Clause
"""Random torques that a model allows for: white ones, and Gauss-Markov ones that last.

A lasting torque is given as the acceleration w that it causes, so that its size does not change with the parameters
that a calibration looks for. Otherwise small inertias would be cheaper: they need less torque for the same motion.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

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
        memory: density of each memory of the state, shape (n_memory,). Where torques last, theirs stand last, link
            before motor [rad/s^2/sqrt(s)].
        unseen: index of the motor behind which each link swings that no sensor sees, -1 for others, shape (n_link,);
            empty for none. Its random torques cannot be told from those of the motor, where friction and ripples act.
        correlation_time: T of the torques that last, dw/dt = -w / T + white noise [s]; 0 where none do.
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
    correlation_time: float = 0.0
    unseen: Array = field(default_factory=lambda: np.zeros(0, dtype=int))

    @property
    def n_lasting(self) -> int:
        """Number of torques that last: one in each equation of motion, or none."""
        return len(self.link_velocity) + len(self.motor_velocity) if self.correlation_time > 0.0 else 0

    @property
    def lasting(self) -> Array:
        """Standard deviation of the acceleration w of each torque that lasts, shape (n_lasting,) [rad/s^2]."""
        own = self.memory[len(self.memory) - self.n_lasting :]
        return np.asarray(own * np.sqrt(0.5 * self.correlation_time))

    def drift(self, seconds: float) -> Array:
        """Standard deviation of the velocities after some time in which nothing is measured, link before motor [rad/s].

        A torque that lasts moves a velocity by 2 a^2 T (t - T (1 - exp(-t / T))), squared.
        """
        white = np.concatenate([self.link_velocity, self.motor_velocity])
        T = self.correlation_time
        if not self.n_lasting:
            return np.asarray(white * np.sqrt(seconds))
        lasting = 2.0 * T * (seconds + T * np.expm1(-seconds / T))
        return np.asarray(np.sqrt(white**2 * seconds + self.lasting**2 * lasting))

    @property
    def white(self) -> ProcessNoise:
        """The same without torques that last."""
        own = self.memory[: len(self.memory) - self.n_lasting]
        return replace(self, memory=own, correlation_time=0.0)

    def with_lasting(self, correlation_time: float, sigma: Array) -> ProcessNoise:
        """The same with other torques that last.

        Args:
            correlation_time: T [s].
            sigma: standard deviation of each acceleration, link before motor, shape (n_link + n_motor,) [rad/s^2].
        """
        own = self.white
        density = sigma * np.sqrt(2.0 / correlation_time)
        return replace(own, memory=np.concatenate([own.memory, density]), correlation_time=correlation_time)
