# SPDX-License-Identifier: BSD-3-Clause
"""Position of a target on a link, as a tracker measures it: forward kinematics of the links, less what was measured.

    residual = R_tracker_base (p_base(q_link, p_link) - place) - p_measured

Variables: X at the time of the sample, and dynamics, which holds what the robot file lists of the place of the target
on its link and of the place and turn of the tracker; R_base_tracker = R_file Exp([turn]x).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.factor import Linearization
from jointscope.factors.sensor_factor import SensorFactor
from jointscope.robots.bodies.body_points import body_point
from jointscope.robots.bodies.body_rates import skew
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.parts.position_target import PositionTarget, turned
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PositionTargetFactor(SensorFactor[PositionTarget]):
    """Residual = predicted - measured position in the axes of the tracker; measured has shape (m, 3) [m].

    Attributes:
        tree: rigid bodies.
        layout: of the states.
        fixed: parameters that calibration leaves alone, by full name.
    """

    tree: RigidTree
    layout: StateLayout
    fixed: Mapping[str, float]

    blocks = (DYNAMICS,)

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Predicted - measured, shape (m, 3) [m]."""
        at, R, place, _ = self.sensor.seen(self._values(calibration))
        point = body_point(self.tree, self.sensor.body, at, x[0][:, self.layout.q_link])
        return (point.value - place) @ R - self.measured

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and derivatives."""
        at, R, place, turn = self.sensor.seen(self._values(calibration))
        point, m = body_point(self.tree, self.sensor.body, at, x[0][:, self.layout.q_link]), len(self.measured)
        by_state = np.zeros((m, 3, self.layout.size))
        by_state[:, :, self.layout.q_link] = R.T @ point.by_q
        predicted = (point.value - place) @ R
        # Exp(turn + d) = Exp(turn) Exp(J d), so that its transpose moves what is predicted by [predicted]x J d
        slopes = (R.T @ point.R_base_body, np.broadcast_to(-R.T, (m, 3, 3)), skew(predicted) @ _right_jacobian(turn))
        by_dynamics, columns = np.zeros((m, 3, len(calibration.names))), list(calibration.names)
        for names, slope in zip((self.sensor.offset, self.sensor.place, self.sensor.turn), slopes, strict=True):
            for axis, name in enumerate(names):
                if name in columns:
                    by_dynamics[:, :, columns.index(name)] = slope[:, :, axis]
        by_block = {DYNAMICS: by_dynamics * calibration.value_by_coordinate}
        return Linearization(predicted - self.measured, (by_state,), by_block)

    def _values(self, calibration: Calibration) -> dict[str, float]:
        return {**self.fixed, **calibration.by_name}


def _right_jacobian(turn: Array) -> Array:
    """J with Exp(turn + d) = Exp(turn) Exp(J d) to first order, the mean of Exp(-s turn) over s from 0 to 1, (3, 3)."""
    nodes, weights = np.polynomial.legendre.leggauss(8)  # exact to 1e-13 for turns below pi
    return np.asarray(sum(0.5 * w * turned(-0.5 * (1.0 + s) * turn) for s, w in zip(nodes, weights, strict=True)))
