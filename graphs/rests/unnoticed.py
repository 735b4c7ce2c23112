# SPDX-License-Identifier: BSD-3-Clause
"""How wrong a mass or all loads may be before rests of rigid joints contradict: what they leave to the URDF and /load.

Friction holds a wrong weight as well as the right one, as long as its band is wide enough. Each is set off alone, all
other values follow, and the rests contradict where they become as unlikely as a doubt is (doubts.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.rests.doubts import LIKELY, AskedOfRests
from jointscope.robots.model.robot import Robot

STEPS = 6  # of a bisection on a logarithmic scale
SMALLEST = 0.01  # share that is looked at


@dataclass(frozen=True)
class Unnoticed:
    """An error that rests would not notice.

    Attributes:
        label: ID@OWNER of the effect.
        size: largest of it, either way, in the unit of its first value; infinite where nothing contradicts.
        share: of the mass or the loads that the model has.
    """

    label: str
    size: float
    share: float


def unnoticed(asked: AskedOfRests, robot: Robot) -> tuple[Unnoticed, ...]:
    """Of each link's mass, in the order of the joints, and of all loads together where there are any.

    Args:
        asked: the rests about their solution.
        robot: whose URDF has the masses.
    """
    tree, found = robot.tree.model, []
    for label, columns in asked.groups.items():
        effect, _, owner = label.partition("@")
        if effect == "link_mass" or (effect == "load_scale" and np.any(asked.linear.Y[:, columns])):
            whole = float(tree.inertias[tree.getJointId(owner)].mass) if effect == "link_mass" else 1.0
            if whole > 0.0:
                share = _hidden_share(asked, columns[:1], whole)
                found.append(Unnoticed(label, share * whole, share))
    return tuple(found)


def _hidden_share(asked: AskedOfRests, column: NDArray[np.intp], whole: float) -> float:
    """Largest share of what the model has by which a value may be off, either way; infinite from all of it on."""
    linear, (n, k) = asked.linear, asked.told(column)
    if not 0 < k < n:
        return float("inf")
    chance = -n / (n - 1.0) * np.log(LIKELY)  # half the fall of chi2 of which doubts.py says that it is no chance
    most = linear.minimum(np.append(asked.base, column))[1] + chance

    def hidden(share: float) -> bool:
        d = np.zeros(linear.A.shape[0])
        d[column] = share * whole
        there = 0.5 * d @ linear.A @ d + linear.b @ d - linear.counts @ np.log(1.0 + linear.G @ d)
        return bool(there + linear.moved(d).minimum(asked.base)[1] < most)

    return max(_edge(hidden, sign) for sign in (-1.0, 1.0))


def _edge(hidden: Callable[[float], bool], sign: float) -> float:
    """Where it shows, up to a few percent."""
    if hidden(sign):
        return float("inf")
    low, high = np.log(SMALLEST), 0.0
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if hidden(sign * float(np.exp(middle))) else (low, middle)
    return float(np.exp(high))
