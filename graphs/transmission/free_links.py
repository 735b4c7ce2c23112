# SPDX-License-Identifier: BSD-3-Clause
"""A recording of a robot with free links as the solver sees it: no states, shared values and what is its own.

Blocks: dynamics (sizes of effects), mountings of gyros; for itself each recording has zeros of its encoders, which
nobody knows where motors count from where they were switched on, and biases of its gyros.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.block import VECTOR, Block
from jointscope.factors.calibration import DYNAMICS, Calibration, bias_block, rotation_block
from jointscope.factors.factor import Factor
from jointscope.factors.priors import BiasPrior
from jointscope.graphs.solving.normal_equations import NormalEquations
from jointscope.graphs.transmission.equation import (
    Equation,
    delay_name,
    gear_equation,
    gyro_equation,
    sizes_of,
)
from jointscope.graphs.transmission.joint_signals import JointSignals, joint_signals
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]
ZEROS = "motor_zeros"
LOOSE = 10.0  # times its start, prior sigma of a size


@dataclass(frozen=True)
class EquationRows:
    """One equation at some values.

    Attributes:
        equation: its samples.
        predicted: everything included, shape (m, c).
        by_shared: derivative of what is predicted by all coordinates of the calibration, shape (m, c, p).
    """

    equation: Equation
    predicted: Array
    by_shared: Array

    @property
    def residual(self) -> Array:
        """Predicted less measured, shape (m, c) [sigma]."""
        return (self.predicted - self.equation.measured) / self.equation.sigma


@dataclass(frozen=True)
class FreeLinks:
    """One recording of a robot with free links (`SetProblem`).

    Attributes:
        robot: with parameters fixed that no equation has.
        recording: the data.
        owner: number of the recording; None for a whole one.
    """

    robot: Robot
    recording: Recording
    owner: int | None = None

    kind = "links"

    @staticmethod
    def of(robot: Robot, recordings: Sequence[Recording]) -> list[FreeLinks]:
        """Recordings of one robot; parameters that no equation has stay as they are.

        Raises:
            RecordingError: sensors have hardly any instants in common.
        """
        problems = [FreeLinks(robot.in_posture(recording.posture), recording) for recording in recordings]
        seen = {name for e in problems[0].equations(Calibration.of(problems[0].robot)) for name in e.columns}
        springs = {f"{h.owner}." for h in robot.effects if h.effect.id == "joint_elasticity"}
        told = {}
        for name, p in robot.parameters.items():
            has_equation = name in seen and (p.effect is not None or name.startswith(tuple(springs)))
            # what is plausible in the catalogue is so for arms of a few kilograms; the start may say more
            loose = p.prior_sigma if p.positive else max(p.prior_sigma, LOOSE * abs(p.value))
            told[name] = replace(p, prior_sigma=loose, fixed=p.fixed or not has_equation)
        return [replace(problem, robot=replace(problem.robot, parameters=told)) for problem in problems]

    @property
    def measured(self) -> int:
        """Number of measured values."""
        n = len(self.signals.times) * self.robot.n
        return n + sum(self.recording.streams[gyro.name].values.size for gyro in self.robot.gyros)

    @property
    def priors(self) -> tuple[Factor, ...]:
        """Of the biases; zeros have none."""
        return tuple(BiasPrior(gyro) for gyro in self.robot.gyros)

    def of_robot(self, robot: Robot) -> FreeLinks:
        """The same recording of a robot with other values or effects."""
        return replace(self, robot=robot)

    @cached_property
    def signals(self) -> JointSignals:
        """What the joints did."""
        return joint_signals(self.recording, self.robot)

    @cached_property
    def gears(self) -> list[Equation]:
        """One equation for each joint."""
        return [gear_equation(self.signals, self.robot, j) for j in range(self.robot.n)]

    def start(self, common: Calibration) -> tuple[Array, Calibration]:
        """No states; zeros at the mean of what the values leave."""
        robot, n = self.robot, self.robot.n
        blocks = [DYNAMICS, *(f(gyro.name) for gyro in robot.gyros for f in (rotation_block, bias_block))]
        calibration = common.only(blocks).with_blocks([(Block(ZEROS, VECTOR, "recording", n, "z"), np.zeros(n))])
        left = [np.mean(rows.equation.measured - rows.predicted) for rows in self.rows(calibration)[:n]]
        return np.zeros((0, 1)), calibration.with_points({ZEROS: np.array(left)})

    def equations(self, calibration: Calibration) -> list[Equation]:
        """All equations, gyros with their mountings and delays."""
        values = self.values(calibration)
        gyros = [
            gyro_equation(
                self.recording, self.robot, gyro, calibration.rotations[gyro.name], values.get(delay_name(gyro), 0.0)
            )
            for gyro in self.robot.gyros
        ]
        return [*self.gears, *gyros]

    def values(self, calibration: Calibration) -> dict[str, float]:
        """Values of all parameters, those that are held included."""
        return self.robot.values | calibration.by_name

    def rows(self, calibration: Calibration) -> list[EquationRows]:
        """All equations at the values of a calibration."""
        return [self._rows(e, calibration) for e in self.equations(calibration)]

    def _rows(self, e: Equation, calibration: Calibration) -> EquationRows:
        slopes = dict(zip(calibration.names, calibration.value_by_coordinate.tolist(), strict=True))
        places = {name: calibration.columns[DYNAMICS].start + i for i, name in enumerate(calibration.names)}
        predicted, J = e.predicted.copy(), np.zeros((*e.measured.shape, calibration.size))
        for name, (size, by_value, by_compliance) in sizes_of(self.values(calibration)).items():
            if name not in e.columns:
                continue
            if name not in {delay_name(gyro) for gyro in self.robot.gyros}:  # the prediction is at the delay
                predicted += e.columns[name] * size
            if name in places:
                J[:, :, places[name]] += e.columns[name] * by_value * slopes[name]
            compliance = f"{name.split('.')[0]}.joint_elasticity.compliance"
            if by_compliance and compliance in places:
                J[:, :, places[compliance]] += e.columns[name] * by_compliance * slopes[compliance]
        if e.position is None:
            start = calibration.columns[rotation_block(e.name)].start
            for k, axis in enumerate("xyz"):
                J[:, :, start + k] = e.columns[f"{e.name}.R_imu_body.{axis}"]
            predicted += calibration.biases[e.name]
            J[:, :, calibration.columns[bias_block(e.name)]] = np.eye(3)
        else:
            j = self.robot.joints.index(e.name.removesuffix(".gear"))
            predicted += calibration[ZEROS][j]
            J[:, :, calibration.columns[ZEROS].start + j] = 1.0
        return EquationRows(e, predicted, J)

    def linearize(self, x: Array, calibration: Calibration) -> NormalEquations:
        """Normal equations of the shared values."""
        system = NormalEquations.zeros(0, 1, calibration.size)
        for rows in self.rows(calibration):
            r = rows.residual.reshape(-1)
            J = rows.by_shared.reshape(len(r), -1) / rows.equation.sigma
            system.C += J.T @ J
            system.g_p += J.T @ r
            system.cost += 0.5 * float(r @ r)
        return system
