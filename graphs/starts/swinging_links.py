# SPDX-License-Identifier: BSD-3-Clause
"""Links that no sensor sees start where their springs would have them, not where their motors are.

    q_link(s) = (2 zeta w s + w^2) / (s^2 + 2 zeta w s + w^2) (q_motor - g / K)(s),   w^2 = K / J,  2 zeta w = D / J

with the inertia J of each joint at its mean posture, as if the others stood. A link that begins at its motor would need
large torques out of nothing, and dry friction turns these into a rough way to the solution.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem

Array = NDArray[np.float64]


def swinging_links(problem: BagProblem, calibration: Calibration, q_motor: Array, v_motor: Array) -> Array | None:
    """(q_link, v_link), shape (m + 1, 2n); None where a sensor sees links or a transmission mixes the joints.

    Args:
        problem: recording and model.
        calibration: with springs and dampers.
        q_motor: angles of the motors, shape (m + 1, n).
        v_motor: their velocities, shape (m + 1, n).
    """
    robot, ticks = problem.robot, problem.timeline.ticks
    if robot.gyros or robot.link_encoder is not None or robot.transmission is not None or not robot.layout.motors:
        return None
    from scipy.signal import cont2discrete, lfilter

    values = robot.values
    values |= calibration.by_name
    still = robot.layout.from_joints(np.mean(np.hstack([q_motor, v_motor, q_motor, v_motor]), axis=0)[None, :])
    springs = problem.dynamics.model.springs(still, values)
    inertia = np.diagonal(robot.tree.mass_matrix(np.mean(q_motor, axis=0)[None, :])[0])
    weight = robot.tree.torque(q_motor, 0.0 * v_motor, 0.0 * v_motor)
    q, v, period = q_motor.copy(), v_motor.copy(), float(np.median(np.diff(ticks)))
    for j, joint in enumerate(robot.joints):
        K, D, J = springs.stiffness[j], springs.damping[j], inertia[j]
        if joint not in robot.layout.motors or not (K > 0.0 and J > 0.0):
            continue
        numerator, denominator, _ = cont2discrete(([D / J, K / J], [1.0, D / J, K / J]), period, "foh")
        wanted = q_motor[:, j] - weight[:, j] / K
        q[:, j] = wanted[0] + lfilter(np.ravel(numerator), denominator, wanted - wanted[0])
        v[:, j] = lfilter(np.ravel(numerator), denominator, v_motor[:, j])
    return np.hstack([q, v])
