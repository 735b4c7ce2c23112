# SPDX-License-Identifier: BSD-3-Clause
"""Torque that repeats with the position of a rigid joint, by regression: the order that explains most.

A ripple has more shapes than other effects, so that some order always explains a little: it must explain nearly all,
and pays for the orders that were tried. Over less than a period it is like a spring with a bend, and only looks alike.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.regression.evidence import evidence
from jointscope.graphs.scoring.regression.joint_regression import Fit, JointRows, fit
from jointscope.graphs.starts.windowed_sums import WIDTHS
from jointscope.robots.files.effect_catalogue import catalogue

Array = NDArray[np.float64]

EFFECT, ORDER = "cogging", "order"
HIGHEST = 60.0  # periods per turn: windows smear what is faster
LEAST = 0.5  # period over the stroke
LEFT = 0.25  # of the mean square that the plain regression leaves, which may be left
SIZES = 2  # of each order


class Ripple(NamedTuple):
    """The ripple of a joint.

    Attributes:
        order: periods per turn.
        periods: over the stroke of the joint.
        plain, best: the regression without and with it.
        driving: mean square of the commands.
        evidence: for it, with its order and the orders tried as a price.
    """

    order: float
    periods: float
    plain: Fit
    best: Fit
    driving: float
    evidence: float


def ripple_of(rows: JointRows, joint: int) -> Ripple | None:
    """The ripple that explains most of what one joint lacks; None where none explains nearly all.

    Args:
        rows: of the regression.
        joint: index.
    """
    name, effect = rows.robot.joints[joint], catalogue()[EFFECT]
    if name not in effect.owners_of(rows.robot) or rows.robot.has_effect(EFFECT, name):
        return None
    if name in rows.robot.tree.slides:  # orders are of a turn
        return None
    positions = rows.positions(joint)
    stroke = max(float(np.ptp(q)) for q in positions)
    (grid,) = (p.grid for p in effect.parameters_at(rows.robot, name) if p.name == ORDER)
    turns = [order * stroke / (2.0 * np.pi) for order in grid]
    whole = [order for order, periods in zip(grid, turns, strict=True) if periods >= 1.0 and order <= HIGHEST]
    parts = [order for order, periods in zip(grid, turns, strict=True) if LEAST <= periods < 1.0]
    best = _best(rows, joint, positions, whole) or _best(rows, joint, positions, parts)
    return None if best is None else best._replace(periods=best.order * stroke / (2.0 * np.pi))


def _best(rows: JointRows, joint: int, positions: list[Array], orders: list[float]) -> Ripple | None:
    waves = [[wave(order * q) for order in orders for wave in (np.cos, np.sin)] for q in positions]
    widths = [width for width in WIDTHS if orders and rows.open_at(joint, width, LEFT)]
    found = [one for width in widths if (one := _under(rows, joint, width, orders, waves)) is not None]
    return max(found, key=lambda ripple: ripple.evidence, default=None)


def _under(rows: JointRows, joint: int, width: float, orders: list[float], waves: list[list[Array]]) -> Ripple | None:
    """What windows of one width [s] say."""
    beside = rows.beside(joint, width, rows.with_own(joint, waves))
    if beside is None:
        return None
    here, before = beside[0], beside[0].shape[1] - SIZES * len(orders)
    plain, driving = fit(rows.robot, joint, here[:, :before]), float(np.mean(here[:, 0] ** 2))
    fits = [fit(rows.robot, joint, _with(here, before, i)) for i in range(len(orders))]
    i = int(np.argmin([one.left for one in fits]))
    if plain.left <= 0.0 or driving <= 0.0 or fits[i].left > LEFT * plain.left:
        return None
    worth = evidence(plain.left, fits[i].left, rows.seconds(width, len(here)), SIZES + 1) - np.log(len(orders))
    return Ripple(orders[i], 0.0, plain, fits[i], driving, float(worth))


def _with(here: Array, before: int, i: int) -> Array:
    first = before + SIZES * i
    return np.hstack([here[:, :before], here[:, first : first + SIZES]])
