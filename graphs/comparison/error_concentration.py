# SPDX-License-Identifier: BSD-3-Clause
"""In which motion of which joints a squared error is concentrated.

A regime says something about an error if it holds much more of the squared error than of the time. Among all joints and
regimes the one with the largest difference of the two shares is chosen; further joints come along while they add
clearly to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.problem.motion_regimes import WHOLE_ROBOT

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CLEARLY = 0.2  # difference of the shares below which an error counts as spread over all motion
ANOTHER_JOINT = 0.1  # by which one more joint has to raise it


@dataclass(frozen=True)
class Concentration:
    """Where an error is.

    Attributes:
        regime: name of a regime; empty if the error is spread over all motion.
        joints: indices of the joints whose motion it is; empty for regimes of the whole robot.
        error_share: of the squared error.
        time_share: of the predictions.
    """

    regime: str
    joints: tuple[int, ...]
    error_share: float
    time_share: float

    @property
    def difference(self) -> float:
        """Share of the error beyond that of the time."""
        return self.error_share - self.time_share


EVERYWHERE = Concentration("", (), 1.0, 1.0)


def concentration(squares: Array, masks: Mapping[str, Mask]) -> Concentration:
    """The regime and the joints that tell most about an error.

    Args:
        squares: squared errors, shape (m,).
        masks: by regime, shape (m, n), or (m, 1) for those of the whole robot.
    """
    best = EVERYWHERE
    for regime, mask in masks.items():
        if regime == "other":
            continue
        found = _within(squares, regime, mask)
        if found.difference > max(best.difference, CLEARLY):
            best = found
    return best


def _within(squares: Array, regime: str, mask: Mask) -> Concentration:
    """The best choice of joints in one regime: the best single one, then others while they pay."""
    if regime in WHOLE_ROBOT:
        return shares(squares, regime, mask, ())
    singles = [shares(squares, regime, mask, (j,)) for j in range(mask.shape[1])]
    best = max(singles, key=lambda c: c.difference)
    for single in sorted(singles, key=lambda c: -c.difference):
        joint = single.joints[0]
        if joint in best.joints:
            continue
        wider = shares(squares, regime, mask, tuple(sorted((*best.joints, joint))))
        if wider.difference > best.difference + ANOTHER_JOINT:
            best = wider
    return best


def shares(squares: Array, regime: str, mask: Mask, joints: tuple[int, ...]) -> Concentration:
    """Shares of the error and of the time in one regime of some joints; arguments as in `concentration`."""
    inside = np.any(mask[:, joints] if joints else mask, axis=1)
    total = float(np.sum(squares))
    share = float(np.sum(squares[inside])) / total if total > 0.0 else 0.0
    return Concentration(regime, joints, share, float(np.mean(inside)))
