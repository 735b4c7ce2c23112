# SPDX-License-Identifier: BSD-3-Clause
"""An estimator for tests: exact integration of nothing, it holds the newest encoder sample and remembers its calls."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np


class HoldingEstimator:
    """Links where the motors are, at rest; knows nothing before the first encoder sample."""

    def __init__(self, robot, lag):
        self.robot, self.lag = robot, lag
        self.samples, self.commands, self.asked = [], [], []
        self.events = [SimpleNamespace(kind="alarm", source="imu1.x"), SimpleNamespace(kind="late", source="imu1")]
        self.status = SimpleNamespace(dropped={"imu1": {"late": 2}}, restarts=0)
        self._mean, self._known = np.zeros(robot.layout.size), False

    def sample(self, name, t, values, about=None):
        self.samples.append((name, t, np.array(values)))
        if name == self.robot.motor_encoder.name:
            layout = self.robot.layout
            self._mean[layout.joint_q] = self._mean[layout.motor_q] = values
            self._known = True

    def command(self, t, u):
        self.commands.append((t, np.array(u)))

    def state(self, t=None):
        self.asked.append(t)
        size = len(self._mean)
        covariance = np.eye(size) if self._known else np.full((size, size), np.inf)
        return SimpleNamespace(mean=self._mean.copy(), covariance=covariance)
