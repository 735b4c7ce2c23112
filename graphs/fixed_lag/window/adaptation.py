# SPDX-License-Identifier: BSD-3-Clause
"""Slow adaptation of chosen parameters: the motion's derivative by each, and a model that follows their estimates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.state_rates import StateRates
from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.effect_kinds.lagging_reading import LaggingReading
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.effect_kinds.smoothed_reading import SmoothedReading
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.errors import EstimatorError
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

STEP = 1e-4  # relative change of a parameter for the difference quotient; laws are smooth in their parameters
REBUILT = 0.1  # [sigma] of a parameter's own uncertainty after which the model is built anew
WIDEST = 0.3  # share of a positive parameter's value that it may be wrong by at the beginning
SMALLEST = 0.05  # share of the file's value below which a positive parameter is not followed


class Adaptation:
    """Rates of the state and their derivatives by the adapted parameters.

    Args:
        robot: with the values at which adaptation begins.
        names: full names of the parameters.

    Attributes:
        model: with the values of `at`.
        at: values at which the model was built, shape (p,).
    """

    def __init__(self, robot: Robot, names: Sequence[str]):
        self._robot, self.names = robot, tuple(names)
        self._start = np.array([robot.parameters[name].value for name in self.names])
        self._floor = np.array(
            [
                SMALLEST * abs(robot.parameters[name].value) if robot.parameters[name].positive else -np.inf
                for name in names
            ]
        )
        self._build(self._start)

    def follow(self, values: Array, sigmas: Array) -> bool:
        """Builds the model anew where its values are too far from these, shape (p,) each; says whether it did."""
        far = bool(self.names) and bool(np.any(np.abs(values - self.at) > REBUILT * np.maximum(sigmas, 1e-12)))
        if far:
            self._build(np.maximum(values, self._floor))
        return far

    def know_velocities(self, sigma: Array) -> None:
        """Tells the model how well velocities are known that friction acts against; see `StateRates`."""
        for model in (self.model, *self._variants):
            model.know_velocities(sigma)

    def slopes(self, x: Array, u: Array) -> Array:
        """Derivative of dx/dt by the parameters at a state and a command, shape (d, p)."""
        here = self.model.rates(x, self.model.command_torque(u))
        moved = [v.rates(x, v.command_torque(u)) for v in self._variants]
        return np.column_stack([(m - here) / step for m, step in zip(moved, self._steps, strict=True)])

    def _build(self, values: Array) -> None:
        self.at = values
        named = dict(zip(self.names, values.tolist(), strict=True))
        self.model = StateRates(self._robot, named)
        self._steps = STEP * np.maximum(np.abs(self._start), 1e-6)
        self._variants = [
            StateRates(self._robot, {**named, name: named[name] + step})
            for name, step in zip(self.names, self._steps, strict=True)
        ]


def checked_densities(robot: Robot, densities: Mapping[str, float]) -> dict[str, float]:
    """Densities of the walks of parameters, by full name [unit/sqrt(s)].

    Raises:
        EstimatorError: no such parameter, one that is not part of the motion, or an impossible density.
    """
    outside = {
        here.parameter(p.name): here.label
        for here in robot.effects
        if isinstance(here.effect, LaggingReading | ReadingEffect | SmoothedReading | TimeShift | CommandEffect)
        for p in here.effect.parameters_at(robot, here.owner)
    }
    for name, density in densities.items():
        if name not in robot.parameters:
            known = ", ".join(robot.parameters)
            raise EstimatorError(f"no parameter {name!r} to adapt; robot {robot.name!r} has {known}")
        if name in outside:
            raise EstimatorError(f"{name} cannot be adapted: {outside[name]} acts on stamps, readings or commands")
        if not (math.isfinite(density) and density > 0.0):
            raise EstimatorError(
                f"adapting {name} needs a positive density of its walk [unit/sqrt(s)]; got {density:g}"
            )
    return {name: float(density) for name, density in densities.items()}


def prior_sigmas(robot: Robot, names: Sequence[str]) -> Array:
    """Standard deviations with which adaptation begins, shape (p,): of the calibration, else of the prior.

    Never wider than a share of the value where there is one: equations are linear in a parameter over some ten percent
    only, and a stiffness that could be anything was thrown far away by its first samples and stayed there.
    """
    found = [robot.parameters[name] for name in names]
    sigmas = np.array([p.sigma if p.sigma is not None else p.prior_sigma for p in found], dtype=float)
    widest = [WIDEST * abs(p.value) if p.positive else math.inf for p in found]
    return np.minimum(sigmas, widest)
