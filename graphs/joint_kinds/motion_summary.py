# SPDX-License-Identifier: BSD-3-Clause
"""What recordings of motion tell of the values, as one Gaussian factor: states, biases and mountings are eliminated.

    cost(p) = cost + g' (p - p0) + 1/2 (p - p0)' A (p - p0)

p0 are the values where the motion was solved last. An effect that does nothing in the motion leaves its factor as it
is, so a model with that effect is calibrated with all kinds without a look at any sample of the motion. It holds near
p0: who uses it looks how far the values went, in sigmas.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.joint_kinds.beside_motion import coordinates_told
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import Elimination, eliminations_of
from jointscope.graphs.solving.batch_solver import reduced_system
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.normal_equations import NormalEquations
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
LEAST = 1e-12  # of the largest eigenvalue in prior sigmas: less is rounding


@dataclass(frozen=True)
class MotionSummary:
    """The factor (`SetProblem`); it has no states of its own.

    Attributes:
        robot: the model.
        names: of the dynamic parameters that A is of, shape (p,); a robot may have others beside.
        at: their coordinates p0, shape (p,).
        information: A, shape (p, p).
        slope: g, shape (p,).
        covariance: of these coordinates where all kinds had solved them, shape (p, p).
        measured: number of measured values that it stands for.
        owner: None, it is whole.
    """

    robot: Robot
    names: tuple[str, ...]
    at: Array
    information: Array
    slope: Array
    covariance: Array
    measured: int
    owner: int | None = None

    kind: str = field(default="motion", init=False)
    priors: tuple[()] = field(default=(), init=False)

    @staticmethod
    def of(result: CalibrationResult) -> MotionSummary:
        """The factor of the motions of a calibration, linearised where it ended."""
        robot = replace(result.robot, noise=result.noise)
        problems = [BagProblem.of(robot, bag.recording, bag.ticks) for bag in result.bags]
        calibrations = tuple(bag.calibration for bag in result.bags)
        estimate = Estimate(tuple(bag.states for bag in result.bags), calibrations)
        A, g = _without_blocks(problems, estimate, eliminations_of(problems, estimate))
        names = calibrations[0].names
        _, covariance, _ = coordinates_told(result, names)
        samples = sum(len(placed.factor) for problem in problems for placed in problem.sensors)
        return MotionSummary(robot, names, calibrations[0].dynamics, A, g, covariance, samples)

    def of_robot(self, robot: Robot) -> MotionSummary:
        """The same recordings of a robot with other values, or with effects that do nothing in them."""
        return replace(self, robot=robot)

    def start(self, common: Calibration) -> tuple[Array, Calibration]:
        """No states."""
        return np.zeros((0, 1)), common.only([DYNAMICS])

    def linearize(self, x: Array, calibration: Calibration) -> NormalEquations:
        """Normal equations of the shared values; the cost is that above the least one."""
        return NormalEquations.gaussian(calibration, self.names, self.at, self.information, self.slope, self._depth)

    def moved(self, calibration: Calibration) -> float:
        """How far values went from where the motion was linearised, in sigmas of all kinds, the largest one."""
        places = [calibration.names.index(name) for name in self.names]
        return float(np.max(np.abs(calibration.dynamics[places] - self.at) / np.sqrt(np.diag(self.covariance))))

    @property
    def _depth(self) -> float:
        """Cost at p0 above the least one."""
        unit = np.array([self.robot.parameters[name].coordinate_sigma for name in self.names])
        size, V = np.linalg.eigh(self.information * np.outer(unit, unit))
        told = size > LEAST * max(float(size[-1]), 1e-300)
        along = V[:, told].T @ (self.slope * unit)
        return 0.5 * float(np.sum(along**2 / size[told]))


def _without_blocks(
    problems: Sequence[BagProblem], estimate: Estimate, eliminations: Sequence[Elimination]
) -> tuple[Array, Array]:
    """Information on the dynamic parameters and slope by them, all other blocks and their priors eliminated."""
    shared = SharedLayout.of(estimate.calibrations, len(problems))
    H, g = reduced_system(problems, eliminations, shared, estimate.calibrations, without=(DYNAMICS,))
    kept = np.zeros(shared.size, dtype=bool)
    kept[shared.columns[DYNAMICS]] = True
    if np.all(kept):
        return H, g
    others = H[np.ix_(kept, ~kept)] @ np.linalg.inv(H[np.ix_(~kept, ~kept)])
    return H[np.ix_(kept, kept)] - others @ H[np.ix_(~kept, kept)], g[kept] - others @ g[~kept]
