# SPDX-License-Identifier: BSD-3-Clause
"""Smoothed motion of one recording with everything that regressors are built from; never a measured signal."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.simpson_dynamics import SimpsonDynamics
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.normal_equations import CHUNK
from jointscope.robots.dynamics.accelerations import Accelerations
from jointscope.robots.dynamics.carried_weight import CarriedWeight
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.dynamics.transmission import Transmission, is_behind
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ScoreSignals:
    """Motion at the m + 1 ticks of a recording.

    Attributes:
        robot: the model with the calibration's values.
        model: its equations of motion.
        parameters: values of the free parameters, shape (p,).
        values: all parameters by full name.
        ticks: shape (m + 1,) [s].
        x: smoothed states, shape (m + 1, d).
        seen: the same as springs and motors see them, through the transmission, shape (m + 1, d).
        torque_map: puts torques behind the transmission into the equations of motion, shape (r, r); None for none.
        rate: their time derivative by differences, shape (m + 1, d).
        a_link: link accelerations by the model, shape (m + 1, n_link) [rad/s^2].
        M_inverse: shape (m + 1, n_link, n_link).
        u: logged commands of the m steps, shape (m, n).
        response: accelerations per unit of each command, shape (m, r, n).
        stiffness, damping: of every joint, shape (n,); zero for rigid ones.
        tau_spring: shape (m + 1, n) [N m]; of rigid joints the weight that they carry.
        weight: what every gear carries, shape (m + 1, n) [N m].
        inertia: of each motor, shape (n,) [kg m2].
        shared: what hypotheses that differ in their shapes alone have in common, by label; they fill it.
    """

    robot: Robot
    model: ElasticJoints
    parameters: Array
    values: dict[str, float]
    ticks: Array
    x: Array
    seen: Array
    torque_map: Array | None
    rate: Array
    a_link: Array
    M_inverse: Array
    u: Array
    response: Array
    stiffness: Array
    damping: Array
    tau_spring: Array
    weight: Array
    inertia: Array
    shared: dict[str, Any] = field(default_factory=dict, repr=False)

    @staticmethod
    def of(problem: BagProblem, x: Array, calibration: Calibration) -> ScoreSignals:
        """From a solved recording, each tick with the command of the step that begins there."""
        first, last = problem.dynamics.commands_at_ends(calibration.values)
        u, sliding = np.vstack([first, last[-1:]]), problem.dynamics.steps.at_ticks
        return ScoreSignals._at(problem, problem.timeline.ticks, x, u, calibration, sliding)

    @staticmethod
    def at_ends(problem: BagProblem, x: Array, calibration: Calibration) -> ScoreSignals:
        """The same where each of the m steps ends, with the command of that step: accelerations jump with commands."""
        u, sliding = problem.dynamics.commands_at_ends(calibration.values)[1], problem.dynamics.steps.ends
        return ScoreSignals._at(problem, problem.timeline.ticks[1:], x[1:], u, calibration, sliding)

    @staticmethod
    def between(problem: BagProblem, x: Array, calibration: Calibration) -> tuple[ScoreSignals, Array]:
        """The same in the middle of each step of Simpson's rule, and how accelerations depend on rates there.

        Returns:
            Motion at m middles, and derivatives, shape (m, r, r).
        """
        model, ticks, dynamics = problem.dynamics.model, problem.timeline.ticks, problem.dynamics
        u, steps, p = dynamics.command(calibration.values), dynamics.steps, calibration.values
        first, last = dynamics.commands_at_ends(p)
        parts = ((x[:-1], first, steps.begins), (x[1:], last, steps.ends))
        ends = [model.accelerations(part, own, p, sliding) for part, own, sliding in parts]
        assert isinstance(dynamics, SimpsonDynamics)
        middle, sliding = dynamics.middle(x[:-1], x[1:], *ends), steps.throughout
        parts_there = _differentiated(model, middle, u, p, sliding)
        found = np.concatenate([part.by_state[:, :, model.layout.rates] for part in parts_there])
        times = 0.5 * (ticks[:-1] + ticks[1:])
        return ScoreSignals._at(problem, times, middle, u, calibration, sliding), found

    @staticmethod
    def _at(
        problem: BagProblem,
        ticks: Array,
        x: Array,
        u: Array,
        calibration: Calibration,
        sliding: Array | None,
    ) -> ScoreSignals:
        """From states with the command that acts at each, shape (m + 1, n)."""
        model, parameters = problem.dynamics.model, calibration.values
        values, layout = model.named(parameters), model.layout
        a_link, M_inverse, response = [], [], []
        for part in _differentiated(model, x, u, parameters, sliding):
            a_link.append(part.value[:, : layout.n_link])
            M_inverse.append(part.rigid.by_torque)
            response.append(model.command_response(part, parameters))
        springs, transmission = model.springs(x, values), Transmission.of(problem.robot)
        weight = CarriedWeight(problem.robot).torque(x, values)
        return ScoreSignals(
            robot=problem.robot.with_values(values),
            model=model,
            parameters=parameters,
            values=values,
            ticks=ticks,
            x=x,
            seen=model.seen(x, values),
            torque_map=None if transmission is None else transmission.maps(values)[1],
            rate=np.gradient(x, ticks, axis=0, edge_order=2),
            a_link=np.concatenate(a_link),
            M_inverse=np.concatenate(M_inverse),
            u=u[:-1],
            response=np.concatenate(response)[:-1],
            stiffness=springs.stiffness,
            damping=springs.damping,
            tau_spring=np.where(springs.stiffness > 0.0, springs.torque, weight),
            weight=weight,
            inertia=model.motor_inertia(values),
        )

    def in_equations(self, tau: Array, here: EffectAt) -> Array:
        """Torques of an effect in the equations of motion, shape (m + 1, r) both."""
        return tau if self.torque_map is None or not is_behind(here, self.robot) else tau @ self.torque_map.T

    def accelerations(self, tau: Array) -> Array:
        """What torques on the equations of motion do, shape (m + 1, r) both; rows of memories are zero."""
        layout = self.model.layout
        n = layout.n_link
        a = np.zeros((len(tau), layout.n_rates))
        for j in range(n):
            if np.any(tau[:, j]):  # most effects act on one joint
                a[:, :n] += self.M_inverse[:, :, j] * tau[:, j, None]
        elastic = [layout.joints.index(joint) for joint in layout.motors]
        a[:, n : n + layout.n_motor] = tau[:, n : n + layout.n_motor] / self.inertia[elastic]
        return a


def _differentiated(
    model: ElasticJoints, x: Array, u: Array, parameters: Array, sliding: Array | None
) -> Iterator[Accelerations]:
    """Accelerations with derivatives, some ticks at a time: of all they are a fifth of a gigabyte for each minute."""
    for first in range(0, len(x), CHUNK):
        own = slice(first, first + CHUNK)
        yield model.with_derivatives(x[own], u[own], parameters, None, None if sliding is None else sliding[own])
