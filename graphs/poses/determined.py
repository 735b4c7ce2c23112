# SPDX-License-Identifier: BSD-3-Clause
"""What poses determine: errors that they tell apart, and the target anywhere the joints may go.

Rank, and the combinations of geometric errors that move no target, by name.

Columns are taken in the order of the chain. One that those before it make up to a share of TOLERANCE adds nothing; what
makes it up is the combination. The order is that of the arm, so neither that of the file nor chance changes the answer.
Lengths count in millimetres and angles in milliradians, which are alike on an arm of a metre.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # which asks for what is determined here
    from jointscope.graphs.poses.calibrate_poses import PoseCalibration

Array = NDArray[np.float64]
TOLERANCE = 2e-3  # of a column: what elastic coordinates add to exact combinations is below it
SHOWN = 2e-2  # smallest weight that is named, of the largest one
DRAWN = 300  # postures
SHARE = 0.9  # of them that are known better than what is returned
HALF_TURN = np.pi  # [rad] where the URDF allows more, or sets no limit
STILL = 1e-9  # [m per m or rad] a column that moves nothing


@dataclass(frozen=True)
class Determined:
    """What poses determine.

    Attributes:
        rank: number of independent columns.
        combinations: those that move no target, each as weights by name.
    """

    rank: int
    combinations: tuple[dict[str, float], ...]


def determined(columns: Mapping[str, Array], order: Sequence[str]) -> Determined:
    """Which of some columns are independent.

    Args:
        columns: derivative of all targets by each error, by name, shape (m, 3).
        order: names along the chain.
    """
    kept: list[str] = []
    basis = np.zeros((len(next(iter(columns.values())).reshape(-1)), 0))
    combinations = []
    for name in order:
        column = columns[name].reshape(-1)
        size = float(np.linalg.norm(column))
        if size < STILL * np.sqrt(len(column)):
            combinations.append({name: 1.0})
            continue
        weights = np.linalg.lstsq(basis, column, rcond=None)[0] if kept else np.zeros(0)
        if np.linalg.norm(column - basis @ weights) > TOLERANCE * size:
            kept.append(name)
            basis = np.column_stack([basis, column])
            continue
        own = {name: 1.0} | {other: -float(w) for other, w in zip(kept, weights, strict=True)}
        largest = max(map(abs, own.values()))
        combinations.append({n: float(f"{w:.3g}") for n, w in own.items() if abs(w) > SHOWN * largest})
    return Determined(len(kept), tuple(combinations))


def combination_text(weights: Mapping[str, float]) -> str:
    """A combination as a sum: "joint2.ly - joint3.ly"."""
    parts: list[str] = []
    for name, weight in weights.items():
        size = "" if abs(abs(weight) - 1.0) < 5e-3 else f"{abs(weight):.3g} "
        sign = ("-" if weight < 0 else "") if not parts else (" - " if weight < 0 else " + ")
        parts.append(f"{sign}{size}{name}")
    return "".join(parts)


def sigma_elsewhere(result: PoseCalibration) -> float:
    """Uncertainty of the target at postures all over the joints' limits [m].

    What all of them have in common, a turn and a shift of the base, does not count: contacts never tell it.

    Returns:
        Root of the trace of its covariance, which nine tenths of the postures do not exceed.
    """
    problem, calibration = result.problems[0], result.calibrations[0]
    arm = problem.arm
    limits = result.robot.tree.limits[arm.chain.places]
    limits = np.where(np.isfinite(limits), np.clip(limits, -HALF_TURN, HALF_TURN), [-HALF_TURN, HALF_TURN])
    q = np.random.default_rng(0).uniform(limits[:, 0], limits[:, 1], (DRAWN, len(limits)))
    point = arm.at(q, np.zeros_like(q), problem.values(calibration))
    J = np.zeros((DRAWN, 3, len(result.names)))
    for i, (name, scale) in enumerate(zip(calibration.names, calibration.value_by_coordinate, strict=True)):
        if name in point.by_value:
            J[:, :, i] = scale * point.by_value[name]
    turns = np.stack([np.cross(axis, point.target) for axis in np.eye(3)], axis=2)
    common = np.concatenate([np.broadcast_to(np.eye(3), turns.shape), turns], axis=2).reshape(3 * DRAWN, 6)
    flat = J.reshape(3 * DRAWN, -1)
    J = (flat - common @ np.linalg.lstsq(common, flat, rcond=None)[0]).reshape(J.shape)
    return float(np.quantile(np.sqrt(np.einsum("mki,ij,mkj->m", J, result.covariance, J)), SHARE))
