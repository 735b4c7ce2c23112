# SPDX-License-Identifier: BSD-3-Clause
"""By how much inertias are off because of what collocated steps miss.

A light joint whose friction turns over within a small part of a step brakes there by another torque than its equation
says. The error looks like a random torque that always has the same sign, and biases the small inertia: with links of
20 g and 100 Hz by 5 to 26 %, at values that nothing else accuses. What a step misses is the difference between it and
two of half its length over the same motion; direct collocation judges its mesh that way (Betts 2010, Practical Methods
for Optimal Control, chapter 4.7). What that does to the values is one step of least squares: those values, with the
motion as it is, that explain best what was missed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.simpson_dynamics import SimpsonDynamics
from jointscope.graphs.problem.bag_problem import BagProblem

Array = NDArray[np.float64]

INERTIA = "inertia"  # of a drive, after its owner
RISEN = 6.0  # times the smallest random torque; arms that are right at such steps reach 3.5, light ones begin at 11


def inertia_shifts(problem: BagProblem, x: Array, calibration: Calibration) -> dict[str, float]:
    """What missed torques have made of each inertia, as a share of it, by full name.

    None where random torques are next to the smallest one, which stands for what steps miss: there it has done no harm.
    None for the Euler and midpoint rules, too, which a robot file asks for as they are.

    Args:
        problem: one recording, with the noise that was found.
        x: states at its ticks, shape (m + 1, d).
        calibration: values and biases of its recording.
    """
    whole = problem.dynamics
    noise = np.concatenate([whole.steps.noise.link_velocity, whole.steps.noise.motor_velocity])
    if not isinstance(whole, SimpsonDynamics) or not np.any(noise > RISEN * whole.steps.noise.smallest):
        return {}
    rows = _missed(whole, x, calibration)
    slopes = whole.linearize_chain(x, calibration).by_block[DYNAMICS] / whole.steps.sigmas[:, :, None]
    told = np.any(slopes != 0.0, axis=(0, 1))
    shift = np.zeros(slopes.shape[2])
    shift[told] = np.linalg.lstsq(slopes[:, :, told].reshape(-1, told.sum()), rows.reshape(-1))[0]
    parameters = problem.robot.parameters
    changes = zip(calibration.names, calibration.values.tolist(), shift.tolist(), strict=True)
    return {
        name: change if parameters[name].positive else change / value  # positive ones have logarithms for coordinates
        for name, value, change in changes
        if name.endswith(f".{INERTIA}") and value
    }


def _missed(whole: SimpsonDynamics, x: Array, calibration: Calibration) -> Array:
    """What the steps miss in all their rows, whitened, shape (m, r); nothing where an equation does not bind."""
    steps, values = whole.steps, calibration.values
    x0, x1, (u0, u1) = x[:-1], x[1:], whole.commands_at_ends(values)
    a0 = whole.model.accelerations(x0, u0, values, steps.begins)
    a1 = whole.model.accelerations(x1, u1, values, steps.ends)
    middle = whole.middle(x0, x1, a0, a1)
    first, second = (replace(whole, steps=half) for half in steps.halves(whole.model.named(values)))
    d_v, d_q = whole.defects(x0, x1, values)
    first_v, first_q = first.defects(x0, middle, values)
    second_v, second_q = second.defects(middle, x1, values)
    missed_v = first_v + second_v - d_v
    # a velocity that is off after the first half moves positions through both, one that is off at the end hardly
    k = d_q.shape[1]
    missed_q = first_q + second_q + 0.25 * steps.h[:, None] * (first_v - second_v)[:, :k] - d_q
    rows = np.asarray(whole.combined(missed_v, missed_q) / steps.sigmas)
    if steps.free is not None:
        k = steps.free.shape[1]
        rows[:, :k] = np.where(steps.free > 0.0, 0.0, rows[:, :k])
    return rows
