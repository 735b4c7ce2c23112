# SPDX-License-Identifier: BSD-3-Clause
"""A recording with locked springs in the graph: the elements of the transmission that motion and rests see, too.

    encoder of motor j = theta_j,    theta_j = (T^-1 q)_j + z_j    rigid_rows.py; no states are left

Instead of a spring there is a constraint: nothing about stiffness enters. Zeros and the delay of the links' encoders
are the recording's own; effects on encoders act as in every other kind.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.block import VECTOR, Block
from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.locked_springs.locked_readings import LockedReadings
from jointscope.graphs.locked_springs.rigid_rows import RigidRows
from jointscope.graphs.solving.normal_equations import NormalEquations
from jointscope.robots.dynamics.transmission import Transmission, motor_angles
from jointscope.robots.model.robot import Robot
from jointscope.robots.rests.at_encoders import EncoderErrors, encoder_errors, true_positions

Array = NDArray[np.float64]
ZEROS = "locked.zeros"  # of the k motors [rad], and the delay of the links' encoders [s]


@dataclass(frozen=True)
class LockedSet:
    """Locked readings as the solver sees them (`SetProblem`).

    Attributes:
        robot: the model.
        readings: of one recording.
        widened: by what residuals repeat, shape (k,).
        owner: number of the recording; None for a whole one.
    """

    robot: Robot
    readings: LockedReadings
    widened: Array
    owner: int | None = None

    kind: str = field(default="locked_springs", init=False)
    priors: tuple[()] = field(default=(), init=False)

    @property
    def measured(self) -> int:
        """Number of measured values that motors and links have in common."""
        return int(self.readings.q_motor.size)

    def of_robot(self, robot: Robot) -> LockedSet:
        """The same readings of a robot with other values or effects."""
        return replace(self, robot=robot)

    def start(self, common: Calibration) -> tuple[Array, Calibration]:
        """No states; zeros at which the file's matrix fits."""
        found = self.readings
        zeros = np.median(found.q_motor - motor_angles(self.robot, found.q_link)[:, found.rows], axis=0)
        block = Block(ZEROS, VECTOR, "recording", len(zeros) + 1, "l"), np.append(zeros, 0.0)
        return np.zeros((0, 1)), common.only([DYNAMICS]).with_blocks([block])

    def rows(self, calibration: Calibration) -> tuple[RigidRows, Array]:
        """Residuals, and their derivatives by all shared values, shape (m, k, p)."""
        robot, found = self.robot, self.readings
        values = {**robot.values, **calibration.by_name}
        transmission = Transmission(robot, calibration.names)
        A = transmission.inverse(values)
        own = calibration[ZEROS]
        links = true_positions(robot, found.q_link, values, on_links=True)
        of_links = encoder_errors(robot, links, values, on_links=True)
        of_motors = self._motor_errors(values, links @ A.T)
        sigmas = (found.sigma_motor, found.sigma_link)
        rows = RigidRows.of(
            found.q_motor - of_motors.value[:, found.rows], (links, found.v_link, found.a_link), sigmas,
            self.widened, A[found.rows], own[:-1], float(own[-1]),
        )  # fmt: skip
        J = np.zeros((*rows.r.shape, calibration.size))
        by_value = np.zeros((*rows.r.shape, len(calibration.names)))
        for place, (i, j) in transmission.free:
            # T^-1 changes by -T^-1 dT T^-1, and the residual by minus that times the links
            by_value[:, :, place] += A[found.rows, i] * np.einsum("mkn,n->mk", rows.q, A[j])
        for name, slope in of_motors.by_parameter.items():
            if name in calibration.names:
                by_value[:, :, calibration.names.index(name)] -= slope[:, found.rows]
        for name, slope in of_links.by_parameter.items():
            if name in calibration.names:
                by_value[:, :, calibration.names.index(name)] += (slope / (1.0 + of_links.by_position)) @ A[
                    found.rows
                ].T
        J[:, :, calibration.columns[DYNAMICS]] = by_value * calibration.value_by_coordinate
        place = calibration.columns[ZEROS].start
        J[:, np.arange(len(found.rows)), place + np.arange(len(found.rows))] = -1.0
        J[:, :, place + len(found.rows)] = rows.turned
        return rows, J

    def _motor_errors(self, values: Mapping[str, float], seen: Array) -> EncoderErrors:
        """Errors of all motor encoders where the links say that they are, up to their zeros."""
        own = seen.copy()
        own[:, self.readings.rows] = self.readings.q_motor
        return encoder_errors(self.robot, true_positions(self.robot, own, values, on_links=False), values, False)

    def linearize(self, x: Array, calibration: Calibration) -> NormalEquations:
        """Normal equations of the shared values."""
        rows, J = self.rows(calibration)
        system = NormalEquations.zeros(0, 1, calibration.size)
        system.C[:], system.g_p[:] = rows.system(J)
        system.cost = rows.cost
        return system
