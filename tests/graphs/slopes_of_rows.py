# SPDX-License-Identifier: BSD-3-Clause
"""Derivatives of what poses miss, held against differences."""

from __future__ import annotations

import numpy as np

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.poses.tracker_start import placed


def checked_slopes(robot, poses):
    """Derivatives of all rows against differences, at values that are off, and those by what transmissions do.

    Returns:
        The problem, derivatives by name, shape (m, k) each, and what is missed there, shape (m, k).
    """
    robot, (problem,) = placed(robot, [poses])
    start = Calibration.of(robot).only([DYNAMICS])
    rng = np.random.default_rng(0)
    step = 0.3 * np.array([min(robot.parameters[n].coordinate_sigma, 0.1) for n in start.names])
    calibration = start.retract({DYNAMICS: step * rng.standard_normal(len(step))})
    e, size = 1e-3 * rng.standard_normal(problem.q.shape), 1e-6
    point = problem.point(calibration, e)
    J = problem.columns(point, calibration)

    def missed(at, errors):
        return problem.misses(problem.point(at, errors), at)

    for i in range(len(step)):
        d = size * np.eye(len(step))[i]
        ends = [missed(calibration.retract({DYNAMICS: sign * d}), e) for sign in (1.0, -1.0)]
        np.testing.assert_allclose(J[:, :, i], (ends[0] - ends[1]) / (2.0 * size), atol=2e-6, err_msg=start.names[i])
    for j in range(e.shape[1]):
        d = size * np.eye(e.shape[1])[j]
        ends = [missed(calibration, e + sign * d) for sign in (1.0, -1.0)]
        np.testing.assert_allclose(point.by_joint[:, :, j], (ends[0] - ends[1]) / (2.0 * size), atol=2e-6)
    return problem, dict(zip(start.names, np.moveaxis(J, 2, 0), strict=True)), missed(calibration, e)
