# SPDX-License-Identifier: BSD-3-Clause
"""Currents of motors, from what drives them and from their speeds.

    i = g u / k_i - k_e v_motor + offset

k_i is the torque of one ampere behind the gear, g u the torque that the command makes of a motor at rest. Of a motor on
a voltage the speed takes k_e v away. With a gear of ratio n, k_t at the shaft and a winding of resistance R it is g = n
k_t / R and k_i = n k_t, so k_e = n k_t / R is the constant of the voltage itself, k_pwm, unless the robot file gives
another one, as where the supply is not what the file says. k_i k_e is then the back-EMF's part of the motor's damping
k_mi; the rest is viscous friction. The inductance is left out: it rises and falls within a millisecond.

Source: Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, on permanent magnet DC motors.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.motor_current import MotorCurrent

Array = NDArray[np.float64]


class MotorCurrents:
    """The law of one robot with a sensor of its currents.

    Args:
        robot: drives, parameters and the sensor.
        sensor: of its currents.

    Attributes:
        names: of the free parameters, in the order of every parameter vector.
    """

    def __init__(self, robot: Robot, sensor: MotorCurrent):
        self.names = tuple(name for name, parameter in robot.parameters.items() if not parameter.fixed)
        self._fixed, self._volts, self._n = robot.values, robot.command_volts, robot.n
        gain = robot.drive_gain
        self._gain = [None if gain is None else robot.drive_parameter(joint, gain).name for joint in robot.joints]
        self._constant, self._back_emf, self._offset = list[str](), list[str | None](), list[str | None]()
        for joint, of_gain in zip(robot.joints, self._gain, strict=True):
            constant, back_emf, offset = sensor.of_joint(joint)
            self._constant.append(constant if constant in robot.parameters else str(of_gain))
            on_volts = of_gain if gain == "k_pwm" else None
            self._back_emf.append(back_emf if back_emf in robot.parameters else on_volts)
            self._offset.append(offset if offset in robot.parameters else None)

    def named(self, parameters: Array) -> dict[str, float]:
        """All parameters by name: the free ones as given, shape (p,), the fixed ones of the robot."""
        return {**self._fixed, **dict(zip(self.names, parameters.tolist(), strict=True))}

    def value(self, v: Array, u: Array, values: Mapping[str, float]) -> Array:
        """Currents at speeds of the motors and acting commands, shape (m, n) each; shape (m, n) [A]."""
        by_u, by_v, offset = self._slopes(values)
        return np.asarray(u * by_u + v * by_v + offset, dtype=np.float64)

    def slopes(self, values: Mapping[str, float]) -> tuple[Array, Array]:
        """Derivatives by the command and by the speed of each motor, shape (n,) each; they are constants."""
        by_u, by_v, _ = self._slopes(values)
        return by_u, by_v

    def by_parameter(self, v: Array, u: Array, values: Mapping[str, float]) -> Array:
        """Derivatives by the free parameters, shape (m, n, p)."""
        found = np.zeros((len(v), self._n, len(self.names)))

        def add(name: str | None, joint: int, column: Array | float) -> None:
            if name in self.names:
                found[:, joint, self.names.index(name)] += column

        for j in range(self._n):
            k, gain = values[self._constant[j]], self._of(values, self._gain[j], 1.0)
            unit = self._volts * u[:, j]
            add(self._constant[j], j, -gain * unit / k**2)
            add(self._gain[j], j, unit / k)
            add(self._back_emf[j], j, -v[:, j])
            add(self._offset[j], j, 1.0)
        return found

    def constants(self, values: Mapping[str, float]) -> tuple[Array, Array]:
        """Torque of one ampere [N m/A] and current that a speed takes away [A s/rad] of each joint, shape (n,)."""
        constant = np.array([values[name] for name in self._constant])
        return constant, np.array([self._of(values, name, 0.0) for name in self._back_emf])

    def sources(self, joint: int) -> tuple[str, ...]:
        """Full names of the parameters that the back-EMF of a joint is made of."""
        return tuple(name for name in (self._constant[joint], self._back_emf[joint]) if name is not None)

    def _slopes(self, values: Mapping[str, float]) -> tuple[Array, Array, Array]:
        """By command and speed, and offsets, shape (n,) each."""
        constant, back_emf = self.constants(values)
        gain = np.array([self._of(values, name, 1.0) for name in self._gain])
        offset = np.array([self._of(values, name, 0.0) for name in self._offset])
        return gain * self._volts / constant, -back_emf, offset

    @staticmethod
    def _of(values: Mapping[str, float], name: str | None, otherwise: float) -> float:
        return otherwise if name is None else values[name]
