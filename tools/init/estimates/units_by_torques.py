# SPDX-License-Identifier: BSD-3-Clause
"""Units of positions where no gyroscope tells them: those in which the equations of motion explain the commands.

Gravity goes with the sine of a position, accelerations with the position itself: in a wrong unit both cannot hold,
whatever a command's unit is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.screening.open_share import equations_of, open_share
from jointscope.graphs.starts.drive_regression import GAIN
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.recordings.recording import Stream
from jointscope.robots.units import si_factor
from jointscope.tools.init.estimates.position_units import COUNTS, LARGEST, UnitGuess

Array = NDArray[np.float64]

UNITS = ("rad", "deg", "turn")
POOR = 0.02  # of the torque that a usual unit may leave, before others are tried
CLEARLY = 3.0  # times less that another unit must leave
NEAR, STEPS = 2.5, 41  # times the degree in which a common gear is looked for, and steps on either side together
FINE = 1e-4  # of a ratio that is taken
BY_TORQUES = "in no other unit do the masses of the URDF explain the commands"


def unit_by_torques(
    tree: RigidTree, encoder: Stream, command: Stream, found: UnitGuess, *, held: bool = True
) -> UnitGuess:
    """The units found so far, or others that explain the commands clearly better.

    Args:
        tree: the robot, with masses.
        encoder: positions as they stand in the bag.
        command: what drives the joints.
        found: units by limits; units by gyroscopes need no second opinion.
        held: whether a command acts until the next one.
    """
    slides = np.isin(tree.joints, tree.slides)
    if np.all(slides) or found.scales:
        return found

    def left(factor: Array) -> float:
        equations = equations_of(tree, replace(encoder, values=encoder.values * factor), command, held)
        return open_share([equation for equation in equations if GAIN in equation.solve()])

    usual, span = left(found.factor), np.ptp(encoder.values, axis=0)
    if usual > POOR:
        allowed = tree.limits[:, 1] - tree.limits[:, 0]
        tried: dict[float, UnitGuess] = {}
        for unit in UNITS:
            guess = replace(found, units=tuple(u if s else unit for u, s in zip(found.units, slides, strict=True)))
            fits = np.all(span[~slides] * si_factor(unit) <= LARGEST * allowed[~slides])
            if guess.units != found.units and fits:
                tried[left(guess.factor)] = replace(guess, reason=BY_TORQUES)
        best = min(tried, default=np.inf)
        if best < usual / CLEARLY:
            usual, found = best, tried[best]
    if found.units != ("deg",) * tree.n or found.reason == COUNTS:
        return found
    ratio, remaining = _common_gear(lambda scale: left(np.full(tree.n, scale)), si_factor("deg"))
    if not remaining < usual / CLEARLY:
        return found
    reason = f"{BY_TORQUES}: they are measured before gears of {1.0 / ratio:.4g}"
    return UnitGuess(("rad",) * tree.n, reason, (ratio,) * tree.n)


def _common_gear(left: Callable[[float], float], degree: float) -> tuple[float, float]:
    """The scale near a degree that leaves least, and how much: a grid, then thirds of what is left of it."""
    grid = degree * np.geomspace(1.0 / NEAR, NEAR, STEPS)
    costs = [left(scale) for scale in grid]
    k = int(np.argmin(costs))
    low, high = grid[max(k - 1, 0)], grid[min(k + 1, STEPS - 1)]
    while high / low > 1.0 + FINE:
        a, b = low * (high / low) ** (1.0 / 3.0), low * (high / low) ** (2.0 / 3.0)
        low, high = (low, b) if left(a) < left(b) else (a, high)
    scale = float(np.sqrt(low * high))
    return scale, left(scale)
