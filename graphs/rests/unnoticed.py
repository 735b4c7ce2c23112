# SPDX-License-Identifier: BSD-3-Clause
"""How wrong a mass or all loads may be before rests contradict: what they leave to the URDF and /load.

Friction holds a wrong weight as well as the right one, as long as its band is wide enough, and a spring that is stiffer
by as much bends as far under loads that are all larger. Each is set off alone, all
other values follow, and the rests contradict where they become as unlikely as a doubt is (doubts.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.rests.doubts import LIKELY, AskedOfRests
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
STEPS = 6  # of a bisection on a logarithmic scale
SMALLEST = 0.01  # share that is looked at, of rigid joints
FIRST, TRIES = 0.03, 4  # share, and steps from there to where a parabola ends
NOTHING = 1e-3  # of a cost, as exactly as its minimum is found
WEIGHTS = "weights@robot"  # all masses and all loads together


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

    Where springs carry them, of all masses and loads by one share, too.

    Args:
        asked: the rests about their solution.
        robot: whose URDF has the masses.
    """
    tree, found = robot.tree.model, []
    everything = np.zeros(asked.linear.A.shape[0])
    for label, columns in asked.groups.items():
        effect, _, owner = label.partition("@")
        if effect == "link_mass" or (effect == "load_scale" and np.any(asked.linear.Y[:, columns])):
            whole = float(tree.inertias[tree.getJointId(owner)].mass) if effect == "link_mass" else 1.0
            if whole > 0.0:
                everything[columns[0]] = whole
                share = _hidden_share(asked, columns[:1], whole)
                found.append(Unnoticed(label, share * whole, share))
    if not asked.rigid:
        share = _hidden_of_all(asked, everything)
        found.append(Unnoticed(WEIGHTS, share, share))
    return tuple(found)


def _hidden_share(asked: AskedOfRests, column: NDArray[np.intp], whole: float) -> float:
    """Largest share of what the model has by which a value may be off, either way; infinite from all of it on."""
    linear, (n, k) = asked.linear, asked.told(column)
    if not 0 < k < n:
        return float("inf")
    chance = -n / (n - 1.0) * np.log(LIKELY)  # half the fall of chi2 of which doubts.py says that it is no chance
    most = linear.minimum(np.append(asked.base, column))[1] + chance
    d = np.zeros(linear.A.shape[0])
    d[column] = whole
    return _largest(asked, d, most)


def _hidden_of_all(asked: AskedOfRests, d: Array) -> float:
    """The same of values that are off together by one share of d, shape (p,)."""
    return _largest(asked, d, asked.linear.minimum(asked.base)[1] - np.log(LIKELY))


def _largest(asked: AskedOfRests, d: Array, most: float) -> float:
    """Largest share of d, either way, that costs no more than `most` once the values of the model follow."""
    linear = asked.linear

    def over(share: float) -> float:
        off = share * d
        there = 0.5 * off @ linear.A @ off + linear.b @ off - linear.counts @ np.log(1.0 + linear.G @ off)
        return float(there + linear.moved(off).minimum(asked.base)[1] - most)

    if not asked.rigid:
        least = linear.minimum(asked.base)[1] - most
        return max(_edge_of_parabola(over, least, sign) for sign in (-1.0, 1.0))
    return max(_edge(lambda share: over(share) < 0.0, sign) for sign in (-1.0, 1.0))


def _edge(hidden: Callable[[float], bool], sign: float) -> float:
    """Where it shows, up to a few percent."""
    if hidden(sign):
        return float("inf")
    low, high = np.log(SMALLEST), 0.0
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if hidden(sign * float(np.exp(middle))) else (low, middle)
    return float(np.exp(high))


def _edge_of_parabola(over: Callable[[float], float], least: float, sign: float) -> float:
    """The same of what encoders of links see: a cost that grows with the square of the share, or nearly so.

    Args:
        over: cost of a share over what is hidden.
        least: of no share.
        sign: of the shares.
    """
    if least >= 0.0:  # they contradict as they are
        return 0.0
    share = FIRST
    for _ in range(TRIES):
        grown = max(over(sign * share) - least, NOTHING)
        if share == 1.0 and grown < -least:
            return float("inf")
        share = min(share * float(np.sqrt(-least / grown)), 1.0)
    return share
