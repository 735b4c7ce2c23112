# SPDX-License-Identifier: BSD-3-Clause
"""All rests of one recording as one set of states: where links and motors stand in each.

    encoders    q_measured = q + noise                                         scatter and repeatability of each rest
    links       0 = -g(q) + J^T F - A^T tau_c(delta) + effects
    motors      y = tau_motor(u) + tau_c(delta) + effects within the band of dry friction (factors/friction_band.py)

A motor that has not moved since the last rest stands where it stood for another reason: it says nothing of its band.
One that creeps has its friction at the band's edge, as well as this edge repeats. A rigid joint has one coordinate,
which its motor's band holds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.rest_sets.independent_states import of_independent_states
from jointscope.graphs.rest_sets.rest_bands import RestBands, Rows, largest_held
from jointscope.graphs.solving.normal_equations import NormalEquations
from jointscope.graphs.solving.whole_set import WholeSet
from jointscope.robots.bodies.known_loads import known_loads
from jointscope.robots.dynamics.at_rest import AtRest, WithSlopes, at_rest
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.model.robot import Robot
from jointscope.robots.rests.at_encoders import acting_commands, encoder_errors, true_positions
from jointscope.robots.rests.rests import Rests, joined_rests

Array = NDArray[np.float64]
EXACT = 1e-4  # of the largest torque that a coordinate carries: how well equilibrium holds
EDGE = 0.02  # no friction repeats better
SMALLEST_SLOPE = 1e-3  # of the commands that act over those that were recorded
SMALLEST_BAND = 1e-6  # [N m] half width at which a band is a line


@dataclass(frozen=True)
class RestSet:
    """Rests as the solver sees them (`SetProblem`).

    Attributes:
        robot: the model.
        rests: the rests.
        repeatability: factor on the sigmas of the link encoders, shape (n,).
        torque_scale: what torques on links are compared with, shape (n_link,), or (m, n_link) of each rest [N m].
        friction_scale: the same for what friction holds, shape (n,) or (m, n) [N m].
        edge: of its friction, what the edges of a motor's band are blurred by.
        per_command: whether what friction holds is judged by the likelihood of the commands, which were recorded, and
            not by that of the torque: models that make different torques of them can be compared then. A calibration
            that begins far off is better off without.
        scoring: whether bands step by the information that a rest gives on average, as models that contradict their
            rests need, and not by their own curvature.
        owner: number of the recording; None for a whole one.
    """

    robot: Robot
    rests: Rests
    repeatability: Array
    torque_scale: Array
    friction_scale: Array
    edge: float = EDGE
    per_command: bool = False
    scoring: bool = False
    owner: int | None = None

    kind: str = field(default="rests", init=False)
    priors: tuple[()] = field(default=(), init=False)

    @staticmethod
    def of(robot: Robot, rests: Rests) -> RestSet:
        """With scales from the start values of the robot."""
        robot.need_link_dynamics()
        ones = np.ones(robot.n)
        plain = RestSet(robot, rests, ones, np.ones(robot.layout.n_link), ones)
        x, calibration = plain.start(Calibration.of(robot))
        loads, gravity = plain.weights(x[:, robot.layout.q_link])
        carried = np.abs(loads - gravity).max(axis=0)
        moved = np.where(rests.moved, np.abs(plain.torques(x, calibration).motors.value), np.nan)
        held = np.array([np.nanmedian(column) if np.any(np.isfinite(column)) else 1.0 for column in moved.T])
        largest = max(float(carried.max()), 1e-9)
        return replace(plain, torque_scale=np.maximum(carried, 1e-2 * largest), friction_scale=np.maximum(held, 1e-9))

    @staticmethod
    def joined(problems: Sequence[RestSet]) -> RestSet:
        """Some recordings as one set, whose cost is the sum of theirs; one costs less time than many."""
        first, count = problems[0], [len(problem.rests) for problem in problems]
        scales = (
            np.concatenate([np.broadcast_to(scale, (m, scale.shape[-1])) for m, scale in zip(count, each, strict=True)])
            for each in ([p.torque_scale for p in problems], [p.friction_scale for p in problems])
        )
        torque_scale, friction_scale = scales
        rests = joined_rests([problem.rests for problem in problems])
        return replace(first, rests=rests, torque_scale=torque_scale, friction_scale=friction_scale)

    def only(self, kept: NDArray[np.bool_]) -> RestSet:
        """Some of the rests, with the scales that they have here."""
        torque, friction = (s[kept] if s.ndim > 1 else s for s in (self.torque_scale, self.friction_scale))
        return replace(self, rests=self.rests.only(kept), torque_scale=torque, friction_scale=friction)

    @property
    def measured(self) -> int:
        """Number of measured values: positions, and torques that friction holds."""
        encoders = self.robot.n + self.robot.layout.n_motor if self.rests.q_link is not None else self.robot.n
        return len(self.rests) * encoders + int(self.rests.moved.sum())

    def of_robot(self, robot: Robot) -> RestSet:
        """The same rests of a robot with other values or effects."""
        return replace(self, robot=robot)

    @cached_property
    def held(self) -> list[int]:
        """Link coordinates that no motor turns itself, the rows of `AtRest.links`."""
        return [row for row in range(self.robot.layout.n_link) if row not in self.robot.layout.motor_row]

    @cached_property
    def model(self) -> ElasticJoints:
        """Equations of motion."""
        return ElasticJoints(self.robot)

    def start(self, common: Calibration) -> tuple[Array, Calibration]:
        """Where the encoders say."""
        robot, layout, rests = self.robot, self.robot.layout, self.rests
        values = robot.values
        q_motor = true_positions(robot, rests.q_motor, values, on_links=False)
        seen = None if rests.q_link is None else true_positions(robot, rests.q_link, values, on_links=True)
        q_link = joint_angles(robot, q_motor) if seen is None else seen
        x = np.zeros((len(rests), layout.size))
        x[:, layout.motor_q] = q_motor
        x[:, layout.joint_q] = q_link
        return x[:, layout.positions], common.only([DYNAMICS])

    def weights(self, q: Array) -> tuple[Array, Array]:
        """Torques of known loads, and those that hold the links against gravity, at links q, shapes (m, k) [N m]."""
        tree = self.robot.kinematic_tree
        loads = known_loads(tree, self.rests.links, self.rests.forces, q)
        return loads.torque, tree.torque(q, 0.0 * q, 0.0 * q)

    def torques(self, x: Array, calibration: Calibration, more: Array | float = 0.0) -> AtRest:
        """What holds the robot at positions of shape (m, d), under its mean commands and some more, shape (m, n)."""
        robot, model, q = self.robot, self.model, x[:, self.robot.layout.q_link]
        loads = known_loads(robot.kinematic_tree, self.rests.links, self.rests.forces, q)
        u, slopes = acting_commands(robot, self.rests.u + more, model.named(calibration.values))
        found = at_rest(model, x, u, calibration.values, loads, self.rests.creep)
        free = {name: slope for name, slope in slopes.items() if name in model.names}
        if not free:
            return found
        gain, more = model.drive_gain(calibration.values), np.zeros_like(found.motors.by_parameter)
        for name, slope in free.items():
            more[:, :, model.names.index(name)] = gain * slope
        motors, sliding = (
            replace(part, by_parameter=part.by_parameter + more) for part in (found.motors, found.sliding)
        )
        return replace(found, motors=motors, sliding=sliding)

    def encoder_sigmas(self) -> tuple[Array, Array]:
        """Of the means of motor and link encoders in each rest, shape (m, n) each [rad]."""
        robot, rests = self.robot, self.rests
        motor = np.hypot(robot.motor_encoder.sigmas, rests.motor_scatter)
        if robot.link_encoder is None:
            return motor, np.full_like(motor, np.inf)
        link = np.hypot(rests.rounded * robot.link_encoder.sigmas, rests.link_scatter)
        return motor, self.repeatability * link

    def residuals(self, x: Array, values: Mapping[str, float] | None = None) -> Array:
        """Links measured less where they are in equilibrium, in sigmas, shape (m, n); zero without encoders.

        Args:
            x: shape (m, d).
            values: of the robot's parameters by full name, where they are others than its own.
        """
        if self.rests.q_link is None:
            return np.zeros_like(self.rests.q_motor)
        q = x[:, self.robot.layout.joint_link]
        values = values or self.robot.values
        reading = q + encoder_errors(self.robot, q, values, on_links=True).value
        return (self.rests.q_link - reading) / self.encoder_sigmas()[1]

    def predicted(self) -> Array:
        """Positions that the robot's own values say from motors and loads, no link encoder read, shape (m, d)."""
        blind = replace(self, rests=replace(self.rests, q_link=None))
        x, calibration = self.start(Calibration.of(self.robot))
        return WholeSet(blind, x, calibration, ()).states

    def linearize(self, x: Array, calibration: Calibration, expected: bool = False) -> NormalEquations:
        """Normal equations at positions of shape (m, d); `expected` as of `RestBands.rows`."""
        return of_independent_states(*self.rows(x, calibration, expected))

    def rows(self, x: Array, calibration: Calibration, expected: bool = False) -> tuple[Array, Array, Array, Array]:
        """What `of_independent_states` makes normal equations of: whitened residuals, derivatives, cost of each rest.

        Returns:
            Shapes (m, k), (m, k, d), (m, k, p) and (m,).
        """
        torques = self.torques(x, calibration)
        r, J, P = self.equations(x, torques, calibration)
        costs = 0.5 * np.sum(r**2, axis=1)
        of_bands, band_costs = self.bands(x, torques, calibration).rows(expected or self.scoring)
        r, J, P = (np.hstack([a, b]) for a, b in zip((r, J, P), of_bands, strict=True))
        return r, J, P, costs + band_costs

    def equations(self, x: Array, torques: AtRest, calibration: Calibration) -> Rows:
        """Rows of encoders, of links in equilibrium, and of motors that creep: all that is Gaussian."""
        sigma = EXACT * self.torque_scale[..., self.held]
        links = self._scaled(torques.links, 1.0 / np.broadcast_to(sigma, torques.links.value.shape), calibration)
        creeping = self._scaled(torques.sliding, (self.rests.creep != 0.0) / self._band_sigma(calibration), calibration)
        parts = [*self._encoders(x, calibration), links, creeping]
        r, J, P = (np.hstack([part[i] for part in parts]) for i in range(3))
        return r, J, P

    def bands(self, x: Array, torques: AtRest, calibration: Calibration) -> RestBands:
        """What friction holds where motors stand at positions x of shape (m, d), whose torques these are.

        Where links swung on while a motor stood, the turning point counts at which friction held most.
        """
        held, of_band, noise, before = largest_held(self, x, torques, calibration)
        sigma = np.hypot(self._band_sigma(calibration), noise)
        plain = np.ones_like(of_band.value)
        y, *y_slopes = self._scaled(held, plain, calibration)
        half, *half_slopes = self._scaled(of_band, plain, calibration)
        counts = (self.rests.moved & (self.rests.creep == 0.0)).astype(float)
        half = np.maximum(half, SMALLEST_BAND)
        slopes = (y_slopes[0], y_slopes[1]), (half_slopes[0], half_slopes[1])
        return RestBands(y, half, *slopes, sigma, before, counts, *self._log_gain(calibration))

    def _log_gain(self, calibration: Calibration) -> tuple[Array, Array]:
        """Logarithm of the torque per command of each motor, relative to its prior, and its derivative by coordinates.

        Of effects on commands the mean slope counts.
        """
        if not self.per_command:
            return np.zeros(self.robot.n), np.zeros((self.robot.n, calibration.size))
        model, u, parameters = self.model, self.rests.u, self.robot.parameters
        acting, by = acting_commands(self.robot, u, model.named(calibration.values))
        size = np.maximum(np.sum(u**2, axis=0), 1e-300)
        slope = np.maximum(np.sum(u * acting, axis=0) / size, SMALLEST_SLOPE)
        priors = np.array([parameters[name].prior for name in model.names])
        own, by_value = model.drive_gain(calibration.values), np.zeros((self.robot.n, len(model.names)))
        gain = slope * own / model.drive_gain(priors)
        for k, name in enumerate(model.names):
            if name in by:
                by_value[:, k] += np.sum(u * by[name], axis=0) / size / slope
            if name.rpartition(".")[2] == self.robot.drive_gain:
                twice = np.where(np.arange(len(model.names)) == k, 2.0, 1.0) * calibration.values
                by_value[:, k] += (model.drive_gain(twice) / own - 1.0) / calibration.values[k]
        P = np.zeros((self.robot.n, calibration.size))
        P[:, calibration.columns[DYNAMICS]] = by_value * calibration.value_by_coordinate
        return np.log(np.maximum(np.abs(gain), 1e-12)), P

    def _band_sigma(self, calibration: Calibration) -> Array:
        gain = np.abs(self.model.drive_gain(calibration.values))
        return np.hypot(self.edge * self.friction_scale, gain * self.rests.u_scatter)

    def places(self, columns: NDArray[np.intp]) -> list[int]:
        """Where columns of the state stand among the positions."""
        place = {int(column): k for k, column in enumerate(self.robot.layout.positions)}
        return [place[int(column)] for column in columns]

    def _encoders(self, x: Array, calibration: Calibration) -> list[Rows]:
        layout, rests = self.robot.layout, self.rests
        found, sigmas = [], self.encoder_sigmas()
        values, names = self.model.named(calibration.values), calibration.names
        sides = [(rests.q_motor, layout.motor_q, sigmas[0], False)]
        if rests.q_link is not None:
            sides.append((rests.q_link, layout.joint_q, sigmas[1], True))
        for measured, columns, sigma, on_links in sides:
            own = self.places(columns)
            error = encoder_errors(self.robot, x[:, own], values, on_links)
            J = np.eye(x.shape[1])[own] * ((1.0 + error.by_position) / sigma)[:, :, None]
            P = np.zeros((*sigma.shape, calibration.size))
            for name, slope in error.by_parameter.items():
                if name in names:
                    k = names.index(name)
                    P[:, :, calibration.columns[DYNAMICS].start + k] = (
                        slope * calibration.value_by_coordinate[k] / sigma
                    )
            found.append(((x[:, own] + error.value - measured) / sigma, J, P))
        return found

    def _scaled(self, part: WithSlopes, weight: Array, calibration: Calibration) -> Rows:
        """Residuals with derivatives by positions and by the calibration's coordinates."""
        P = np.zeros((*part.value.shape, calibration.size))
        P[:, :, calibration.columns[DYNAMICS]] = part.by_parameter * calibration.value_by_coordinate
        wide = weight[:, :, None]
        return part.value * weight, part.by_position * wide, P * wide
