# SPDX-License-Identifier: BSD-3-Clause
"""What dry friction holds at each rest, beside its band: values with slopes, and rows for normal equations.

What was recorded is the command u, not the torque y = G u + ... that friction holds: its likelihood is that of y times
G. Without this factor a drive that makes less torque would always be likelier, since its band is narrower.

A link that swings on takes its motor along until friction holds the turning points of the swing, too
(robots/rests/turning_points.py). The motor stands at each of them, so that its balance is the one at rest, with the
spring stretched as far as the link had turned: the largest torque counts that friction is known to have held.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.friction_band import band_cost
from jointscope.robots.dynamics.at_rest import AtRest, WithSlopes
from jointscope.robots.dynamics.transmission import joint_angles

if TYPE_CHECKING:
    from jointscope.graphs.rest_sets.rest_set import RestSet

Array = NDArray[np.float64]
Rows = tuple[Array, Array, Array]
SMALLEST_CURVATURE = 1e-4  # of the information on y, where no edge is near


@dataclass(frozen=True)
class RestBands:
    """Bands of n motors at m rests.

    Attributes:
        y: torque that friction holds less the middle of its band, shape (m, n) [N m].
        half: half width of the band, positive, shape (m, n) [N m].
        y_slopes, half_slopes: their derivatives by positions, (m, n, d), and by shared coordinates, (m, n, p).
        sigma: noise of y and of the band's edges, shape (m, n) [N m].
        before: by how much y may have been larger when the motor still slipped, shape (m, n) [N m].
        counts: 1 where a motor stands after it has moved, 0 where its friction says nothing, shape (m, n).
        log_gain: logarithm of G relative to its prior, shape (n,).
        log_gain_slopes: its derivative by shared coordinates, shape (n, p).
    """

    y: Array
    half: Array
    y_slopes: tuple[Array, Array]
    half_slopes: tuple[Array, Array]
    sigma: Array
    before: Array
    counts: Array
    log_gain: Array
    log_gain_slopes: Array

    def rows(self, expected: bool = False) -> tuple[Rows, Array]:
        """Rows that have the gradient and the curvature of the likelihood, and its cost, shape (m,).

        Args:
            expected: with the information that a rest gives on average in place of the curvature at these ones.
        """
        found, counts = band_cost(self.y, self.half, self.sigma), self.counts
        yy, yh, hh = found.curvature
        least = SMALLEST_CURVATURE * found.torque_information
        if expected:
            yy, yh, hh = found.torque_information, 0.0 * yh, found.half_information
        else:  # the logarithm of half is steep, not bent: a step by the size of half is right for it
            yy, hh = yy + least, hh + 1.0 / self.half**2
        root = np.sqrt(yy)
        both = yh / root
        rest = np.sqrt(hh - both**2)
        (y_J, y_P), (half_J, half_P) = self.y_slopes, self.half_slopes
        w_y, w_both, w_rest = (counts[:, :, None] * part[:, :, None] for part in (root, both, rest))
        r_y = found.by_torque / root
        rows = [
            (counts * r_y, w_y * y_J + w_both * half_J, w_y * y_P + w_both * half_P),
            (counts * (found.by_half - both * r_y) / rest, w_rest * half_J, w_rest * half_P),
        ]
        rows.append((-counts, 0.0 * self.y_slopes[0], counts[:, :, None] * self.log_gain_slopes))
        r, J, P = (np.hstack(part) for part in zip(*rows, strict=True))
        return (r, J, P), np.sum(counts * (found.cost - self.log_gain), axis=1)


def largest_held(
    problem: RestSet, x: Array, torques: AtRest, calibration: Calibration
) -> tuple[WithSlopes, WithSlopes, Array, Array]:
    """What friction holds, half its band there, the noise that turning points add, and how much more it may have held.

    The last two have shape (m, n) [N m]. A period before the farthest turning point the motor slipped: friction is no
    larger than what it would have had to hold then.

    Args:
        problem: the rests.
        x: positions, shape (m, d).
        torques: there.
        calibration: values.
    """
    held, half, (noise, before) = torques.held, torques.half, np.zeros((2, *problem.rests.q_motor.shape))
    turns, robot, layout = problem.rests.turning_points, problem.robot, problem.robot.layout
    if turns is None:
        return held, half, noise, before
    links = problem.places(layout.joint_q)
    own = joint_angles(robot, np.eye(robot.n))  # row j: the links, where the spring of motor j turns by one
    springs = np.array([joint in layout.motors for joint in robot.joints])
    for side in (0, 1):
        there = x.copy()
        there[:, links] += np.where(springs, turns.links[:, side], 0.0)
        found = problem.torques(there, calibration, turns.commands[:, side])
        farther = np.abs(found.held.value) > np.abs(held.value)
        by_own = _by_own(found.held, links, own)
        noise = np.where(farther, by_own * turns.sigma[:, side], noise)
        before = np.where(farther, by_own * turns.fall[:, side], before)
        held, half = found.held.where(farther, held), found.half.where(farther, half)
    return held, half, noise, before


def _by_own(held: WithSlopes, links: list[int], own: Array) -> Array:
    """Size of what a turn of its own spring changes of what each motor's friction holds, shape (m, n) [N m/rad]."""
    return np.abs(np.einsum("mnk,nk->mn", held.by_position[:, :, links], own))
