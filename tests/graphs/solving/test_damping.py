# SPDX-License-Identifier: BSD-3-Clause
"""Damping finds the size that a curved valley asks for, also where that lies between two that differ by its factor."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from jointscope.factors.block import VECTOR, Block
from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.solving import batch_solver
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.convergence import LAMBDA_FACTOR
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.normal_equations import NormalEquations
from jointscope.robots.model.robot import Robot

PLACE = "valley.place"


@dataclass(frozen=True)
class CurvedValley:
    """Rosenbrock's valley b = a^2, which is `steep` times as steep across as along it; its end is at (1, 1)."""

    robot: Robot
    steep: float
    owner: int | None = None

    kind = "valley"
    priors = ()
    measured = 2

    def of_robot(self, robot):
        return replace(self, robot=robot)

    def start(self, common):
        place = (Block(PLACE, VECTOR, "recording", 2, "p"), np.array([-1.2, 1.0]))
        return np.zeros((0, 1)), common.only([DYNAMICS]).with_blocks([place])

    def linearize(self, x, calibration):
        columns, (a, b) = calibration.columns[PLACE], calibration[PLACE]
        r = np.array([1.0 - a, self.steep * (b - a**2)])
        J = np.zeros((2, calibration.size))
        J[:, columns] = [[-1.0, 0.0], [-2.0 * self.steep * a, self.steep]]
        system = NormalEquations.zeros(0, 1, calibration.size)
        system.C[:], system.g_p[:] = J.T @ J, J.T @ r
        system.cost = 0.5 * float(r @ r)
        return system


@pytest.fixture
def walked(doggy):
    """The solution in a valley of some steepness."""
    calibration = Calibration.of(doggy)

    def walk(steep):
        valley = CurvedValley(doggy, steep)
        x, own = valley.start(calibration)
        return solve([valley], Estimate((x,), (own,)), max_iterations=500, step_tolerance=1e-3, hold=(DYNAMICS,))

    return walk


@pytest.mark.parametrize("steep", [30.0, 300.0])
def test_a_curved_valley_is_walked_in_fewer_steps_than_with_one_factor(walked, steep, monkeypatch):
    found = walked(steep)
    np.testing.assert_allclose(found.estimate.calibrations[0][PLACE], [1.0, 1.0], atol=1e-3)
    monkeypatch.setattr(batch_solver, "LEAST_FACTOR", LAMBDA_FACTOR)
    before = walked(steep)
    assert len(found.iterations) < 0.7 * len(before.iterations)
