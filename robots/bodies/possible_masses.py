# SPDX-License-Identifier: BSD-3-Clause
"""Whether the moving bodies of a URDF could be made of anything: masses in grams make them heavier than solid steel.

Of all bodies with mass m and moment J = integral of r^2 dm the ball is the most compact, J = 3/5 m R^2, so somewhere a
body is at least as dense as that ball. Levers count as size, too: many files have moments that are mere placeholders.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin

STEEL = 7900.0  # [kg/m3]; no arm is as heavy as one that is solid steel all through


class Heavy(NamedTuple):
    """Moving bodies that are too heavy for their size.

    Attributes:
        link: the heaviest one.
        mass: its mass [kg].
        density: of all moving bodies together, at least [kg/m3].
    """

    link: str
    mass: float
    density: float


def impossible_masses(model: pin.Model) -> Heavy | None:
    """What is too heavy to exist; None where nothing is, or nothing has both mass and size.

    Args:
        model: what moves, with what is fixed to it.
    """
    bodies = [(j, model.inertias[j]) for j in range(1, model.njoints) if model.inertias[j].mass > 0.0]
    squares = [float(0.5 * np.trace(b.inertia) / b.mass + b.lever @ b.lever) for _, b in bodies]  # [m2]
    volume = sum(4.0 / 3.0 * np.pi * (5.0 / 3.0 * max(square, 0.0)) ** 1.5 for square in squares)
    if not bodies or volume == 0.0:
        return None
    density = sum(body.mass for _, body in bodies) / volume
    if density <= STEEL:
        return None
    j, heaviest = max(bodies, key=lambda pair: pair[1].mass)
    links = [frame.name for frame in model.frames if frame.parentJoint == j]
    return Heavy(links[0] if links else model.names[j], float(heaviest.mass), float(density))
