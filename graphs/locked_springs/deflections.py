# SPDX-License-Identifier: BSD-3-Clause
"""Springs that are said to be locked, and deflect: a law of rigid motors does not hold, or torque turns them.

A deflection of a spring under weight goes with the angles and looks like a coupling; so the torque that the weight of
the links puts on each rope, T^T g(q), stands beside the angles. A clamp may give way by a small share of the spring's
own compliance: the matrix is wrong by as much as that looks like a coupling, and no sigma says so.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.locked_springs.coupling_matrix import CouplingFit
from jointscope.graphs.screening.transmission_evidence import stated_matrix
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

BEYOND = 5.0  # times what encoders explain, from which residuals are deflections
SIGNIFICANT = 6.0  # sigmas of a compliance
GIVES_WAY = 0.05  # of the spring's own compliance


def check_locked(fit: CouplingFit, robot: Robot) -> None:
    """Refuses recordings in which a spring deflects that is said to be locked.

    Raises:
        RecordingError: one does; the message says by how much.
    """
    for i, readings in enumerate(fit.readings):
        r, turned, noise = _with_loads(fit, i, robot)
        for k, joint in enumerate(readings.joints):
            rms, explained = float(np.sqrt(np.mean(r[:, k] ** 2))), float(fit.explained[k])
            by_load, sigma = turned[:, k]
            span = float(abs(by_load) * np.ptp(noise[:, k]))
            stiffness = robot.values.get(f"{joint}.stiffness")
            yields = stiffness is not None and abs(by_load) > max(GIVES_WAY / stiffness, SIGNIFICANT * sigma)
            if rms > BEYOND * explained or (yields and span > BEYOND * explained):
                unit = robot.unit_at(joint, "rad")
                amount = max(span if yields else 0.0, 2.0 * float(np.quantile(np.abs(r[:, k]), 0.99)))
                raise RecordingError(
                    f"{readings.path}: the spring of {joint} is said to be locked, but deflects by {amount:.2g} {unit} "
                    f"of its motor (residual {rms:.2g} {unit} rms, encoders explain {explained:.2g} {unit}); lock it, "
                    f"or name the others as `locked_springs: [JOINT, ...]` in {robot_argument(robot)}"
                )


def _with_loads(fit: CouplingFit, i: int, robot: Robot) -> tuple[Array, Array, Array]:
    """Residuals of a recording, its compliances with sigmas, and what loads add beside the angles.

    Returns:
        Shapes (m, k) [rad], (2, k) [rad/(N m)] and (m, k) [N m].
    """
    readings, rows = fit.readings[i], fit.rows(i)
    if robot.free_links:
        return rows.r, np.zeros((2, len(readings.joints))), np.zeros_like(rows.r)
    T = stated_matrix(robot)
    A = np.linalg.inv(T)
    A[readings.rows] = fit.A
    q = readings.q_link
    load = (robot.tree.torque(q, 0.0 * q, 0.0 * q) @ np.linalg.inv(A))[:, readings.rows]
    found, sigmas = [], []
    for k in range(len(readings.joints)):
        beside = np.column_stack([q[:, fit.free[k]], np.ones(len(q)), rows.turned[:, k]])
        alone = load[:, k] - beside @ np.linalg.lstsq(beside, load[:, k], rcond=None)[0]
        size = float(alone @ alone)
        if size <= 1e-9 * float(load[:, k] @ load[:, k]) or size <= 0.0:
            found.append(0.0)
            sigmas.append(np.inf)
            continue
        found.append(float(alone @ rows.r[:, k]) / size)
        sigmas.append(float(np.sqrt(rows.S[k, k] / size)))
    return rows.r, np.array([found, sigmas]), load
