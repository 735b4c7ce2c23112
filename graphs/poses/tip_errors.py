# SPDX-License-Identifier: BSD-3-Clause
"""How far predicted targets are from measured ones: the numbers by which a calibrated arm is judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.poses.pose_set import PoseSet, contact_block
from jointscope.robots.geometry.error_parameters import BACKLASH, BEARING, STIFFNESS
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TipErrors:
    """Distances of m poses [m].

    Attributes:
        vectors: predicted less measured, shape (m, 3) [m].
    """

    vectors: Array

    @property
    def distances(self) -> Array:
        """Shape (m,) [m]."""
        return np.asarray(np.linalg.norm(self.vectors, axis=1))

    def to_json(self) -> dict[str, float]:
        """In millimetres."""
        mm = 1e3 * self.distances
        return {
            "mean_mm": float(mm.mean()),
            "p90_mm": float(np.quantile(mm, 0.9)),
            "max_mm": float(mm.max()),
            "rms_mm": float(np.sqrt(np.mean(mm**2))),
        }


def tip_errors(problem: PoseSet, calibration: Calibration | None = None) -> TipErrors:
    """Errors with transmissions that do nothing unseen.

    Args:
        problem: the poses.
        calibration: values, points of contacts included; None for the robot's own values and the points that fit best.
    """
    if calibration is None:
        calibration = problem.start(Calibration.of(problem.robot))[1]
    return TipErrors(problem.misses(problem.point(calibration), calibration))


def without_sag(robot: Robot) -> Robot:
    """The robot with rigid drives and bearings."""
    kept = {n: p for n, p in robot.parameters.items() if not n.endswith((f".{STIFFNESS}", *BEARING))}
    return replace(robot, parameters=kept)


def without_geometry(robot: Robot) -> Robot:
    """The robot as its URDF has it, its stiffnesses as they are."""
    soft = (f".{STIFFNESS}", *BEARING)
    return robot.with_values({n: p.prior for n, p in robot.parameters.items() if not n.endswith(soft)})


def without_backlash(robot: Robot) -> Robot:
    """The robot without gaps."""
    return robot.with_values({name: 0.0 for name in robot.parameters if name.endswith(f".{BACKLASH}")})


def parts_of(problem: PoseSet) -> dict[str, TipErrors]:
    """Errors of the whole model and of the model without each of its parts, by what is there."""
    robot = problem.robot
    variants = {
        "whole model": robot,
        "without sag": without_sag(robot),
        "without geometric errors": without_geometry(robot),
    }
    if any(p.value for n, p in robot.parameters.items() if n.endswith(f".{BACKLASH}")):
        variants["without backlash"] = without_backlash(robot)
    variants["nominal"] = without_geometry(without_sag(robot))
    return {name: tip_errors(replace(problem, robot=other)) for name, other in variants.items()}


def contact_distances(problem: PoseSet, calibration: Calibration) -> dict[str, float]:
    """Distance of the two contacts of each place that has two [m]."""
    points = {place: [calibration[contact_block(c)] for c in pair] for place, pair in problem.pairs.items()}
    return {place: float(np.linalg.norm(a - b)) for place, (a, b) in points.items()}


def summary(errors: Sequence[TipErrors]) -> TipErrors:
    """Several sessions as one."""
    return TipErrors(np.concatenate([each.vectors for each in errors]))
