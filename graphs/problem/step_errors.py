# SPDX-License-Identifier: BSD-3-Clause
"""What a collocated step misses: the difference between one step and two of half its length over the same motion.

A light joint whose friction turns over within a small part of a step brakes there by another torque than its equation
says. The error looks like a random torque that always has the same sign, and biases the small inertia: with links of
20 g and 100 Hz by 5 to 26 %, at values that nothing else accuses. Direct collocation judges its mesh the same way
(Betts 2010, Practical Methods for Optimal Control, chapter 4.7).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.simpson_dynamics import SimpsonDynamics
from jointscope.graphs.problem.bag_problem import BagProblem

Array = NDArray[np.float64]

RISEN = 6.0  # times the smallest random torque; arms that are right at such steps reach 3.5, light ones begin at 11


def step_errors(problem: BagProblem, x: Array, calibration: Calibration) -> Array:
    """What each velocity row misses, as a share of the random torques that were found, shape (k,).

    The root mean square over the steps in which the equation binds. Zero where random torques are next to the smallest
    one, which stands for what steps miss: there it has done no harm. Zero for the Euler and midpoint rules, too, which
    a robot file asks for as they are.

    Args:
        problem: one recording, with the noise that was found.
        x: states at its ticks, shape (m + 1, d).
        calibration: values and biases of its recording.
    """
    whole, k = problem.dynamics, len(problem.robot.layout.velocities)
    noise = np.concatenate([whole.steps.noise.link_velocity, whole.steps.noise.motor_velocity])
    risen = noise > RISEN * whole.steps.noise.smallest
    if not isinstance(whole, SimpsonDynamics) or not np.any(risen):
        return np.zeros(k)
    steps, values = whole.steps, calibration.values
    x0, x1, u = x[:-1], x[1:], whole.command(values)
    a0 = whole.model.accelerations(x0, u, values, steps.begins)
    a1 = whole.model.accelerations(x1, u, values, steps.ends)
    middle = whole.middle(x0, x1, a0, a1)
    half = replace(whole, steps=replace(steps, h=0.5 * steps.h))
    d_v, d_q = whole.defects(x0, x1, values)
    first_v, first_q = half.defects(x0, middle, values)
    second_v, second_q = half.defects(middle, x1, values)
    missed_v = first_v + second_v - d_v
    missed_q = first_q + second_q + 0.5 * steps.h[:, None] * first_v[:, : d_q.shape[1]] - d_q
    rows = (steps.combine(missed_v, missed_q) / steps.sigmas)[:, :k]
    if steps.free is not None:
        rows = np.where(steps.free > 0.0, 0.0, rows)
    return np.where(risen, np.sqrt(np.mean(rows**2, axis=0)), 0.0)
