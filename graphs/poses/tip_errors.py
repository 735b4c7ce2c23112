# SPDX-License-Identifier: BSD-3-Clause
"""How far predicted targets are from measured ones: the numbers by which a calibrated arm is judged.

Distances in millimetres, and where orientations were measured the turns between both in milliradians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.poses.pose_set import PoseSet, contact_block
from jointscope.graphs.poses.trimmed_poses import squared_distances
from jointscope.robots.geometry.error_parameters import BACKLASH, BEARING, STIFFNESS
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.pose_setup import PoseSetup

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TipErrors:
    """Errors of all targets that were seen, pose after pose.

    Attributes:
        vectors: predicted less measured, shape (s, 3) [m].
        poses: number of the pose of each, shape (s,).
        names: of the target of each.
        turns: from measured orientations to predicted ones, shape (t, 3) [rad].
        turned: number of the pose of each of these, shape (t,).
        turned_names: of the target of each of these.
    """

    vectors: Array
    poses: NDArray[np.intp]
    names: tuple[str, ...]
    turns: Array
    turned: NDArray[np.intp]
    turned_names: tuple[str, ...]

    @property
    def distances(self) -> Array:
        """Shape (s,) [m]."""
        return np.asarray(np.linalg.norm(self.vectors, axis=1))

    @property
    def angles(self) -> Array:
        """Sizes of the turns, shape (t,) [rad]."""
        return np.asarray(np.linalg.norm(self.turns, axis=1))

    @property
    def of_targets(self) -> dict[str, TipErrors]:
        """Errors of each target by its name."""
        found = {}
        for name in dict.fromkeys(self.names):
            mine = np.array([other == name for other in self.names], bool)
            turned = np.array([other == name for other in self.turned_names], bool)
            count, of_turns = int(mine.sum()), int(turned.sum())
            found[name] = TipErrors(
                self.vectors[mine], self.poses[mine], (name,) * count,
                self.turns[turned], self.turned[turned], (name,) * of_turns,
            )  # fmt: skip
        return found

    def to_json(self) -> dict[str, float]:
        """In millimetres, and where orientations were measured in milliradians."""
        found = _sizes(1e3 * self.distances, "mm")
        return found | (_sizes(1e3 * self.angles, "mrad") if len(self.turns) else {})


def _sizes(errors: Array, unit: str) -> dict[str, float]:
    return {
        f"mean_{unit}": float(errors.mean()),
        f"p90_{unit}": float(np.quantile(errors, 0.9)),
        f"max_{unit}": float(errors.max()),
        f"rms_{unit}": float(np.sqrt(np.mean(errors**2))),
    }


def targets_json(errors: TipErrors) -> dict[str, dict[str, dict[str, float]]]:
    """Errors of each target by its name; nothing where there is but one."""
    each = errors.of_targets
    return {"targets": {name: found.to_json() for name, found in each.items()}} if len(each) > 1 else {}


def tip_errors(problem: PoseSet, calibration: Calibration | None = None) -> TipErrors:
    """Errors with transmissions that do nothing unseen.

    Args:
        problem: the poses.
        calibration: values, points of contacts included; None for the robot's own values and the points that fit best.
    """
    if calibration is None:
        calibration = problem.start(Calibration.of(problem.robot))[1]
    rows, seen = problem.misses(problem.point(calibration), calibration), problem.targets
    blocks = rows.reshape(len(rows), -1, 3)
    there = seen.there.reshape(blocks.shape)[:, :, 0]
    places = int(np.count_nonzero(~seen.turns)) // 3
    poses, which = np.nonzero(there[:, :places])
    turned, which_turned = np.nonzero(there[:, places:])
    names, turned_names = seen.names_of(poses, which), seen.names_of_turns(which_turned)
    vectors, turns = blocks[:, :places][there[:, :places]], blocks[:, places:][there[:, places:]]
    return TipErrors(vectors, poses, names, turns, turned, turned_names)


def without_sag(robot: Robot) -> Robot:
    """The robot with rigid drives and bearings."""
    kept = {n: p for n, p in robot.parameters.items() if not n.endswith((f".{STIFFNESS}", *BEARING))}
    return replace(robot, parameters=kept)


def without_geometry(robot: Robot) -> Robot:
    """The robot as its URDF has it, its stiffnesses as they are, and targets whose place nobody gave where they are."""
    soft = (f".{STIFFNESS}", *BEARING)
    found = () if robot.poses is None else tuple(f"{t.name}." for t in robot.poses.others if t.at is None)
    parameters = {n: p for n, p in robot.parameters.items() if not n.startswith(found)} if found else robot.parameters
    return robot.with_values({n: p.prior for n, p in parameters.items() if not n.endswith(soft)})


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
    ends = np.cumsum([0, *(int(each.poses.max(initial=-1)) + 1 for each in errors)])[:-1]
    return TipErrors(
        np.concatenate([each.vectors for each in errors]),
        np.concatenate([each.poses + end for each, end in zip(errors, ends, strict=True)]),
        tuple(name for each in errors for name in each.names),
        np.concatenate([each.turns for each in errors]),
        np.concatenate([each.turned + end for each, end in zip(errors, ends, strict=True)]),
        tuple(name for each in errors for name in each.turned_names),
    )


def whitened(robot: Robot, noise: PoseSetup | None, sessions: Sequence[PoseSet]) -> float:
    """Root mean square error of a model on poses, per coordinate [sigma]; 1 is noise.

    Args:
        robot: the model.
        noise: how large it is.
        sessions: the poses.
    """
    found, counts = [], []
    for problem in sessions:
        other = replace(problem, robot=replace(robot, poses=noise), repeatability=1.0, turning=1.0)
        found.append(squared_distances(other, other.start(Calibration.of(robot))[1]))
        counts.append(other.targets.there.sum(axis=1))
    return float(np.sqrt(np.mean(np.concatenate(found)) / np.mean(np.concatenate(counts))))
