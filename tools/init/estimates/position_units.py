# SPDX-License-Identifier: BSD-3-Clause
"""Units of positions: what the limits of the URDF allow, and what the gyroscopes say about how fast joints turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.recordings.joint_motion import joint_motion
from jointscope.robots.recordings.recording import Stream
from jointscope.robots.units import si_factor
from jointscope.tools.init.estimates.gear_ratios import gear_scales
from jointscope.tools.init.estimates.gyro_mount import SeenRate, find_mount, seen_rate
from jointscope.tools.init.estimates.joint_signs import FEW_JOINTS, joint_left, joint_signs

Array = NDArray[np.float64]

BEYOND = 5.0  # times the range of the URDF that no motion covers
LARGEST = 1.2  # times the range that a motion may cover, for a unit to be possible
HALF, WORTH_CHANGING = 0.5, 0.1  # another unit must leave less than this part, and that much less of the power
FLEXIBLE = 0.05  # relative; ratios nearer to 1 are left to calibration
MUCH_BETTER = 0.25  # of the remaining power that ratios of gears may leave
BEFORE_A_GEAR = (
    "the motion would go far beyond the limits of the URDF otherwise; if these are positions before a gear, write "
    "unit: rad and scale: [1/ratio, ...]"
)
COUNTS = (
    "the motion would go far beyond the limits of the URDF otherwise; values are whole numbers: if they are counts, "
    "write unit: rad and scale: [6.2832/COUNTS_PER_TURN, ...]"
)
INSTANTS, LEAST = 600, 200  # that are enough to judge by; of many joints


@dataclass(frozen=True)
class UnitGuess:
    """Units of positions.

    Attributes:
        units: in the bag, by joint: rad, deg or turn; of a prismatic joint m or mm.
        reason: why others than rad and m; empty for those.
        scales: factors on the values of the bag, as of gears; empty for none.
    """

    units: tuple[str, ...]
    reason: str = ""
    scales: tuple[float, ...] = ()

    @property
    def factor(self) -> Array:
        """From the bag to SI units, shape (n,)."""
        return np.array([si_factor(unit) for unit in self.units]) * np.array(self.scales or 1.0)


def position_units(tree: RigidTree, encoder: Stream, gyros: Sequence[Stream]) -> UnitGuess:
    """Units of the joints' positions.

    Args:
        tree: the robot.
        encoder: positions as they stand in the bag, of all joints.
        gyros: samples as they stand in the bag.
    """
    slides = np.isin(tree.joints, tree.slides)
    span = np.ptp(encoder.values, axis=0)
    allowed = tree.limits[:, 1] - tree.limits[:, 0]
    beyond = span > BEYOND * allowed
    turning, sliding = "deg" if np.any(beyond & ~slides) else "rad", "mm" if np.any(beyond & slides) else "m"
    reason = BEFORE_A_GEAR if np.any(beyond) else ""
    if reason and np.array_equal(encoder.values, np.rint(encoder.values)):
        reason = COUNTS
    by_limits = UnitGuess(tuple(sliding if slide else turning for slide in slides), reason)
    left = {turning: _left(tree, encoder, gyros, by_limits)}
    for unit in ("rad", "deg", "turn"):
        possible = np.all(span[~slides] * si_factor(unit) <= LARGEST * allowed[~slides])
        if gyros and unit not in left and possible:
            left[unit] = _left(tree, encoder, gyros, _with(by_limits, slides, unit))
    best = min(left, key=lambda unit: left[unit])
    found = by_limits
    if left[best] < HALF * left[turning] and left[turning] - left[best] > WORTH_CHANGING:
        found = replace(_with(by_limits, slides, best), reason="so fast do the gyroscopes say that the joints turn")
    return _geared(tree, encoder, gyros, found) or found


def _geared(tree: RigidTree, encoder: Stream, gyros: Sequence[Stream], found: UnitGuess) -> UnitGuess | None:
    """Positions from before gears, where the gyroscopes agree with their ratios much better than with any unit."""
    scales = gear_scales(tree, seen_rates(encoder, gyros))
    if scales is None or np.all(np.abs(scales / found.factor - 1.0) < FLEXIBLE):
        return None
    ratios = ", ".join(f"{1.0 / scale:.4g}" for scale in scales)
    reason = f"so far do the gyroscopes say that the links turn: gears of {ratios}"
    geared = UnitGuess(("rad",) * tree.n, reason, tuple(scales.tolist()))
    if _left(tree, encoder, gyros, geared) > MUCH_BETTER * _left(tree, encoder, gyros, found):
        return None
    return geared


def _with(guess: UnitGuess, slides: NDArray[np.bool_], unit: str) -> UnitGuess:
    return UnitGuess(tuple(u if slide else unit for u, slide in zip(guess.units, slides, strict=True)), guess.reason)


def seen_rates(encoder: Stream, gyros: Sequence[Stream]) -> list[SeenRate]:
    """What those gyroscopes saw that turn, beside the motion of an encoder [rad]."""
    if not gyros:
        return []
    motion = joint_motion(encoder, np.zeros(encoder.values.shape[1]))
    most = min(INSTANTS, max(INSTANTS * FEW_JOINTS // encoder.values.shape[1], LEAST))
    found = [seen_rate(motion, gyro, most) for gyro in gyros]
    return [seen for seen in found if seen is not None]


def _left(tree: RigidTree, encoder: Stream, gyros: Sequence[Stream], guess: UnitGuess) -> float:
    """Mean share of the gyroscopes' power that remains, whichever way joints count; 0 where none says anything."""
    seen = seen_rates(replace(encoder, values=encoder.values * guess.factor), gyros)
    if not seen:
        return 0.0
    mounts = [find_mount(tree, rate, mirrored=True) for rate in seen]
    as_is = float(np.mean([1.0 if mount is None else mount.left for mount in mounts]))
    if as_is < WORTH_CHANGING:
        return as_is
    return min(as_is, joint_left(tree, seen, joint_signs(tree, seen).signs))
