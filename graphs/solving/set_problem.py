# SPDX-License-Identifier: BSD-3-Clause
"""Kinds of recordings beside motion, as the solver sees them.

A motion is a chain of states; rests and poses are a set of states that do not touch each other, frequencies and free
links have none. Each says which blocks it touches and linearises itself to normal equations, those of a chain whose
links are zero; elimination, steps, covariances and GTSAM's graph see no other difference.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Factor
from jointscope.factors.priors import shared_priors
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.normal_equations import NormalEquations, build, cost
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]


class SetProblem(Protocol):
    """All that one recording of another kind says."""

    @property
    def kind(self) -> str:
        """Name of the kind: "rests", "poses", ..."""

    @property
    def robot(self) -> Robot:
        """The model."""

    @property
    def owner(self) -> int | None:
        """Number of the recording where it comes in pieces; None for a whole one."""

    @property
    def measured(self) -> int:
        """Number of measured values."""

    @property
    def priors(self) -> tuple[Factor, ...]:
        """Priors of the blocks that are not the robot's; those of one name count once for each value they bind."""

    def of_robot(self, robot: Robot) -> SetProblem:
        """The same recording of a robot with other values, effects or sensors."""

    def start(self, common: Calibration) -> tuple[Array, Calibration]:
        """States, shape (m, d), and the blocks that it touches.

        A recording without states has m = 0 and d = 1.

        Args:
            common: the blocks of the robot, with their values.
        """

    def linearize(self, x: Array, calibration: Calibration) -> NormalEquations:
        """Normal equations at states of shape (m, d), in the columns of the calibration's blocks."""


Problem = BagProblem | SetProblem


def motions(problems: Sequence[Problem]) -> list[BagProblem]:
    """The motions among some recordings."""
    return [problem for problem in problems if isinstance(problem, BagProblem)]


def motions_only(problems: Sequence[Problem], what: str) -> list[BagProblem]:
    """All recordings, which must be motions.

    Raises:
        SolveError: one is of another kind.
    """
    found = motions(problems)
    if len(found) < len(problems):
        raise SolveError(f"{what} takes recordings of motion only; leave it out")
    return found


def owners(problems: Sequence[Problem]) -> tuple[int, ...]:
    """Recording of each problem: all of them whole, or all of them pieces."""
    return tuple(i if problem.owner is None else problem.owner for i, problem in enumerate(problems))


def linearized(problem: Problem, x: Array, calibration: Calibration) -> NormalEquations:
    """Normal equations of a recording of any kind."""
    return build(problem, x, calibration) if isinstance(problem, BagProblem) else problem.linearize(x, calibration)


def cost_of(problem: Problem, x: Array, calibration: Calibration) -> float:
    """Half the sum of squared whitened residuals of a recording of any kind."""
    return cost(problem, x, calibration) if isinstance(problem, BagProblem) else problem.linearize(x, calibration).cost


def priors_of(problems: Sequence[Problem], calibrations: Sequence[Calibration]) -> Iterator[tuple[Factor, int]]:
    """Priors on values that recordings share, each once, with a piece that has the blocks that it binds."""
    told: set[tuple[str, int]] = set()
    for prior in shared_priors(problems[0].robot):
        for piece, calibration in enumerate(calibrations):
            if set(prior.blocks) <= set(calibration.blocks):
                yield prior, piece
                break
    for piece, (problem, owner) in enumerate(zip(problems, owners(problems), strict=True)):
        for prior in () if isinstance(problem, BagProblem) else problem.priors:
            own = any(calibrations[piece].layout[block].own for block in prior.blocks)
            if (prior.name, owner if own else -1) not in told:
                told.add((prior.name, owner if own else -1))
                yield prior, piece
