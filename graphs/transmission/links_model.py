# SPDX-License-Identifier: BSD-3-Clause
"""A calibrated robot with free links together with its training recordings; where every diagnosis begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.transmission.calibrate_links import calibrate_links
from jointscope.graphs.transmission.free_links import EquationRows, FreeLinks
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording


@dataclass(frozen=True)
class LinksModel:
    """A model calibrated with all training recordings.

    Attributes:
        robot: calibrated.
        recordings: for training.
        result: the calibration.
    """

    robot: Robot
    recordings: tuple[Recording, ...]
    result: CalibrationResult

    @staticmethod
    def of(robot: Robot, recordings: Sequence[Recording]) -> LinksModel:
        """Calibrates a robot."""
        result = calibrate_links(robot, recordings)
        return LinksModel(result.robot, tuple(recordings), result)

    @property
    def error(self) -> float:
        """Root mean square over all channels on the training recordings [sensor sigma]."""
        return float(np.sqrt(np.mean([fit.chi2 for fit in self.result.channels.values()])))

    def rows(self) -> list[EquationRows]:
        """All equations of the training recordings at the calibrated values."""
        pairs = zip(FreeLinks.of(self.robot, self.recordings), self.result.bags, strict=True)
        return [row for problem, bag in pairs for row in problem.rows(bag.calibration)]

    def columns(self) -> tuple[str, ...]:
        """Names of the columns that the model has."""
        mountings = (f"{gyro.name}.R_imu_body.{axis}" for gyro in self.robot.gyros for axis in "xyz")
        return (*self.result.bags[0].calibration.names, *mountings)
