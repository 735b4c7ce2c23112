# SPDX-License-Identifier: BSD-3-Clause
"""Rests linearised by values, as their likelihood is one: commands were recorded, friction and gains are linear in it.

Values above zero have coordinates that are logarithms. Those of friction and of gains are taken as they are here, with
their priors: friction may be zero, and torques are straight lines in gains however far these are off.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.rest_sets.independent_states import reduced
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.linear_rests import LinearRests
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
NONE = 1e-6  # of the information of all, that is none


@dataclass(frozen=True)
class SaidElsewhere:
    """What other recordings and priors say of the p values of a model, as seen from where all have their solution.

    Attributes:
        information: by values, shape (p, p).
        pull: gradient of their cost, shape (p,).
    """

    information: Array
    pull: Array

    @staticmethod
    def of(problem: RestSet, x: Array, calibration: Calibration, covariance: Array) -> SaidElsewhere:
        """What is left of all when that of the rests is taken away.

        Args:
            problem: the rests as they stand in the graph.
            x: states at the solution, shape (m, d).
            calibration: values there.
            covariance: of the values, of all recordings, shape (p, p).
        """
        size, sigma = calibration.value_by_coordinate, np.sqrt(np.diag(covariance))
        H, g = reduced(problem.linearize(x, calibration))
        of_rests = H * np.outer(sigma / size, sigma / size)
        kept, vectors = np.linalg.eigh(np.linalg.inv(covariance / np.outer(sigma, sigma)) - of_rests)
        left = (vectors * np.maximum(kept, NONE)) @ vectors.T
        return SaidElsewhere(left / np.outer(sigma, sigma), -g / size)


@dataclass(frozen=True)
class RestsByValues:
    """The linear model of p values.

    Attributes:
        linear: by changes of the values.
        calibration: of all values, where they are.
        size: of each value by its coordinate, shape (p,).
        friction: values of the bands' widths that are above zero, shape (p,).
        straight: these and gains, shape (p,).
    """

    linear: LinearRests
    calibration: Calibration
    size: Array
    friction: NDArray[np.bool_]
    straight: NDArray[np.bool_]

    @staticmethod
    def of(
        problem: RestSet, robot: Robot, x: Array, calibration: Calibration, elsewhere: SaidElsewhere | None = None
    ) -> RestsByValues:
        """Linearises with priors.

        Args:
            problem: all rests with their weights.
            robot: with the priors of all values.
            x: states of largest likelihood, shape (m, d).
            calibration: values there, those of the robot at their start where it lacks them.
            elsewhere: what other recordings say of these values, in place of priors.
        """
        at = calibration.carried_to(Calibration.of(robot).only([DYNAMICS]))
        free = [robot.parameters[name] for name in at.names]
        prior = np.array([np.log(p.prior) if p.positive else p.prior for p in free])
        commands = replace(problem.of_robot(robot), per_command=True)
        linear = LinearRests.of(commands, x, at, np.zeros(len(free)), np.zeros(len(free)))
        friction = at.positive & np.any(linear.H != 0.0, axis=0)
        straight = friction | (at.positive & np.any(linear.G != 0.0, axis=0))
        size = at.value_by_coordinate
        weight = np.array(
            [
                1.0 / (p.prior_sigma if own else p.coordinate_sigma * each) ** 2
                for p, own, each in zip(free, straight, size, strict=True)
            ]
        )
        off = np.where(straight, at.values - np.array([p.prior for p in free]), (at.dynamics - prior) * size)
        linear = linear.per_value(size)
        A, b = np.diag(weight), weight * off
        if elsewhere is not None:
            p = len(elsewhere.pull)
            A[:p, :p], b[:p] = elsewhere.information, elsewhere.pull
        linear = replace(linear, A=linear.A + A, b=linear.b + b)
        return RestsByValues(linear, at, size, friction, straight)
