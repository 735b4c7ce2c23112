# SPDX-License-Identifier: BSD-3-Clause
"""A tiny kind of recording: known torques on a joint, its deflection read from a dial whose zero nobody knows.

State of each weighing: the deflection x. Equations: K x = torque, dial = x + zero.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.block import VECTOR, Block
from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.solving.normal_equations import NormalEquations
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
ZERO = "dial.zero"


@dataclass(frozen=True)
class WeighedSprings:
    """Weighings of one joint; `sigma` of dial [rad] and torque [N m]."""

    robot: Robot
    joint: str
    torques: Array
    dial: Array
    sigma: tuple[float, float] = (1e-3, 1e-3)
    owner: int | None = None

    kind = "weights"
    priors = ()

    @property
    def measured(self) -> int:
        return len(self.dial)

    def of_robot(self, robot: Robot) -> WeighedSprings:
        return replace(self, robot=robot)

    def start(self, common: Calibration) -> tuple[Array, Calibration]:
        zero = (Block(ZERO, VECTOR, "recording", 1, "z"), np.zeros(1))
        return np.zeros((len(self.dial), 1)), common.only([DYNAMICS]).with_blocks([zero])

    def linearize(self, x: Array, calibration: Calibration) -> NormalEquations:
        i = calibration.names.index(f"{self.joint}.stiffness")
        p, zero, K = calibration.size, calibration.columns[ZERO].start, float(np.exp(calibration.dynamics[i]))
        r = np.stack([(x[:, 0] + calibration[ZERO] - self.dial) / self.sigma[0],
                      (K * x[:, 0] - self.torques) / self.sigma[1]], axis=1)  # fmt: skip
        J = np.broadcast_to(np.array([1.0 / self.sigma[0], K / self.sigma[1]]), r.shape)
        P = np.zeros((*r.shape, p))
        P[:, 0, zero], P[:, 1, i] = 1.0 / self.sigma[0], K * x[:, 0] / self.sigma[1]
        system = NormalEquations.zeros(len(x), 1, p)
        system.D[:, 0, 0], system.g_x[:, 0] = np.sum(J**2, axis=1), np.sum(J * r, axis=1)
        system.B[:, 0] = np.einsum("kr,krp->kp", J, P)
        system.C[:], system.g_p[:] = np.einsum("krp,krq->pq", P, P), np.einsum("kr,krp->p", r, P)
        system.costs[:] = 0.5 * np.sum(r**2, axis=1)
        system.cost = float(np.sum(system.costs))
        return system
