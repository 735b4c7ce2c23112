# SPDX-License-Identifier: BSD-3-Clause
"""A shaken pose as the solver sees it: torque balance of its motors, line by line.

    0 = Z(w) m + j w f m + mu F + shift - tau          motors, with F the spectrum of tanh(k v)

Positions are noisy, and where the motors hardly move Z makes much of it. So what counts is not this residual r, but
Z0 Z^-1 r, with Z0 of the last stage: the positions that the torques predict less those that were measured, as torques.
`shift` is what the torques change by because the arm moves; it and the columns of geometry change little from stage to
stage and stay within one. Where to begin tells the logarithm of the response matrix (Neubauer et al. 2015, eq. 27).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.frequency.motor_stiffness import MotorStiffness, motor_stiffness
from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.graphs.solving.normal_equations import NormalEquations
from jointscope.robots.files.sections.frequency_section import COULOMB, INERTIA
from jointscope.robots.geometry.error_parameters import VISCOUS
from jointscope.robots.geometry.flexible_arm import FlexibleArm
from jointscope.robots.model.robot import SHARPNESS, Robot

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Whitened = tuple[Callable[[Complex], Complex], Complex, dict[str, Complex]]
"""What whitens columns, shape (n, ...) to (l, k, n), motor by motor; the residual and its derivatives before that."""
BAND = 5  # lines whose residuals may be of one cause


@dataclass(frozen=True)
class GeometrySlopes:
    """How M, C and G of the arm follow geometric errors.

    Attributes:
        names: of the errors, shape (v,).
        parts: slopes of M, C and G, shape (v, n, n) each.
    """

    names: tuple[str, ...]
    parts: tuple[Array, Array, Array]


@dataclass(frozen=True)
class Stage:
    """What stays as it is while the solver steps.

    Attributes:
        parts: M, C and G of the arm.
        whiten: of residuals in torques, Z0 included, shape (l, nu, nu); of logarithms 1 over sigma, same shape.
        shift: of the torques because the arm moves and its inertia with it, shape (e, l, nu) [N m].
        friction: spectrum of tanh(k v), and its derivative by log k, shape (e, l, nu) each; None with logarithms.
        sharpness: k of these, shape (nu,) [s/rad].
        geometry: columns of geometric errors by name, shape (e, l, nu), about `values`.
        values: at which all this was found.
        logarithm: whether the response matrix counts, not the torques.
        width: lines on each side whose residuals tell the covariance of one.
        slopes: of the arm by its geometry.
        unlikely: minus twice the logarithm of the likelihood of the residuals at `values`, but for a constant.
        x: motion of the arm behind its springs, shape (b, K, n) [rad]; None with logarithms.
        sharper: derivative by log k of torques that effects of friction have at `values`, shape (e, l, nu) [N m].
    """

    parts: tuple[Array, Array, Array]
    whiten: Complex
    shift: Complex | float
    friction: tuple[Complex, Complex] | None
    sharpness: Array
    geometry: Mapping[str, Complex]
    values: Mapping[str, float]
    logarithm: bool
    width: int
    slopes: GeometrySlopes
    unlikely: float = 0.0
    x: Complex | None = None
    sharper: Complex | float = 0.0


@dataclass(frozen=True)
class FrequencySet:
    """A pose (`SetProblem`); it has no states of its own.

    Attributes:
        robot: with a section `frequency`.
        pose: its spectra.
        stage: of the estimate.
        owner: number of the recording; None for a whole one.
    """

    robot: Robot
    pose: ShakenPose
    stage: Stage
    owner: int | None = None

    kind: str = field(default="frequency", init=False)
    priors: tuple[()] = field(default=(), init=False)

    @property
    def measured(self) -> int:
        """Number of measured values: real and imaginary part at each line."""
        return 2 * (self.pose.matrix.G.size if self.stage.logarithm else self.pose.torques.size)

    def of_robot(self, robot: Robot) -> FrequencySet:
        """The same pose of a robot with other values."""
        return replace(self, robot=robot)

    @cached_property
    def arm(self) -> FlexibleArm:
        """The robot's arm."""
        return FlexibleArm(self.robot)

    def start(self, common: Calibration) -> tuple[Array, Calibration]:
        """No states."""
        return np.zeros((0, 1)), common.only([DYNAMICS])

    def values(self, calibration: Calibration) -> dict[str, float]:
        """Values of all parameters, those that are held included."""
        held = {name: p.value for name, p in self.robot.parameters.items() if p.fixed}
        return held | calibration.by_name

    def linearize(self, x: Array, calibration: Calibration) -> NormalEquations:
        """Normal equations of the shared values."""
        r, J = self.rows(calibration)
        rows, wide = r.reshape(-1), J.reshape(-1, J.shape[-1])
        system = NormalEquations.zeros(0, 1, calibration.size)
        system.C += wide.T @ wide
        system.g_p += wide.T @ rows
        system.cost += 0.5 * float(rows @ rows)
        return system

    def rows(self, calibration: Calibration) -> tuple[Array, Array]:
        """Whitened residuals, shape (l, k), and their derivatives by all coordinates, shape (l, k, p)."""
        values = self.values(calibration)
        whitened, own, by_name = self.logarithms(values) if self.stage.logarithm else self.balance(values)
        none = np.zeros_like(own)
        found = whitened(np.array([own, *(by_name.get(name, none) for name in calibration.names)]))
        both = np.concatenate([found.real, found.imag], axis=1)
        both *= np.sqrt(2.0)  # real and imaginary part have half the variance each
        both[..., 1:] *= calibration.value_by_coordinate
        if calibration.size == len(calibration.names):
            return both[..., 0], both[..., 1:]
        J = np.zeros((*both.shape[:2], calibration.size))
        J[..., calibration.columns[DYNAMICS]] = both[..., 1:]
        return both[..., 0], J

    def slopes(self, calibration: Calibration) -> Array:
        """Slope of the cost of bands of neighbouring lines, all experiments together, shape (b, p)."""
        r, J = self.rows(calibration)
        each = np.einsum("lk,lkp->lp", r, J)
        return np.array([part.sum(axis=0) for part in np.array_split(each, max(len(each) // BAND, 1))])

    def noise_slopes(self, calibration: Calibration) -> Array:
        """Slopes of the cost by the noise of each experiment, which its periods show, shape (s, p)."""
        values = self.values(calibration)
        Z = self.with_friction(self.stiffness(values).Z, values)
        torques, positions, friction = self.pose.changes(self.sharpness(values))
        r = np.einsum("lij,selj->seli", Z, positions) + self._each(values, COULOMB) * friction - torques
        r = np.sqrt(2.0) * np.einsum("lij,selj->seli", self.stage.whiten @ np.linalg.inv(Z), r)
        J = self.rows(calibration)[1].reshape(len(Z), 2, *self.pose.torques.shape[::-2], calibration.size)
        g = [np.einsum("seli,liep->sep", part, J[:, i]) for i, part in enumerate((r.real, r.imag))]
        return np.asarray((g[0] + g[1]).reshape(-1, calibration.size))

    def doubt(self, calibration: Calibration, share: float = 1.0) -> Array:
        """Slope of the cost by what the upper half of a share of the band is worth in the friction, shape (p,)."""
        values = self.values(calibration)
        inverse = np.linalg.inv(self.with_friction(self.stiffness(values).Z, values))
        column = self._each(values, COULOMB) * self.pose.friction_doubt(self.sharpness(values), share)
        d = np.sqrt(2.0) * (self.stage.whiten @ inverse @ column.transpose(1, 2, 0)).reshape(len(inverse), -1)
        _, J = self.rows(calibration)
        return np.asarray(np.einsum("lkp,lk->p", J, np.concatenate([d.real, d.imag], axis=1)))

    def stiffness(self, values: Mapping[str, float]) -> MotorStiffness:
        """Dynamic stiffness of the motors without friction."""
        return motor_stiffness(self.arm, self.stage.parts, self.pose.w, values)

    def with_friction(self, Z: Complex, values: Mapping[str, float], dry: bool = False) -> Complex:
        """The same with viscous friction of the motors, and with the dry one as the carrying motion makes it seem."""
        f = self._each(values, VISCOUS) + (self._each(values, COULOMB) * self._seeming if dry else 0.0)
        return np.asarray(Z + 1j * self.pose.w[:, None, None] * np.diag(f))

    def torque_balance(self, values: Mapping[str, float], k: MotorStiffness) -> Complex:
        """What the motors would need less what they had, shape (e, l, nu) [N m]."""
        pose, stage = self.pose, self.stage
        assert stage.friction is not None
        Z = self.with_friction(k.Z, values)
        r = (Z @ pose.motion[:, pose.lines].transpose(1, 2, 0)).transpose(2, 0, 1) + stage.shift - pose.torques
        sharper = self._sharper(values)
        r += self._each(values, COULOMB) * (stage.friction[0] + sharper * stage.friction[1]) + sharper * stage.sharper
        for name, column in stage.geometry.items():
            r += (values[name] - stage.values[name]) * column
        return np.asarray(r)

    def balance(self, values: Mapping[str, float]) -> Whitened:
        """Torque balance, shape (e, l, nu), its derivative by each value, by name, and what whitens them."""
        pose, stage = self.pose, self.stage
        assert stage.friction is not None
        k, jw = self.stiffness(values), 1j * pose.w[None, :, None]
        r = self.torque_balance(values, k)
        inverse = np.linalg.inv(self.with_friction(k.Z, values))
        turns = pose.motion[:, pose.lines].transpose(1, 2, 0)
        moved = turns - inverse @ r.transpose(1, 2, 0)  # what the torques predict
        W = stage.whiten @ inverse

        def whitened(columns: Complex) -> Complex:
            n, e, lines, nu = columns.shape
            found = W @ columns.transpose(2, 3, 1, 0).reshape(lines, nu, e * n)
            return np.asarray(found.reshape(lines, nu * e, n))

        by_name: dict[str, Complex] = {}
        springs = (k.by_spring @ moved).transpose(0, 3, 1, 2)
        for spring, column in zip(self.arm.springs, springs, strict=True):
            by_name |= {spring.stiffness: column, spring.damping: jw * column}
        mu, sharper = self._each(values, COULOMB), self._sharper(values)
        by_sharpness = stage.sharpness / self.sharpness(values) ** 2
        for i, joint in enumerate(self.arm.joints):
            own = np.eye(len(self.arm.joints))[i]
            by_name[f"{joint}.{VISCOUS}"] = jw * moved.transpose(2, 0, 1) * own
            by_name[f"{joint}.{INERTIA}"] = jw**2 * moved.transpose(2, 0, 1) * own
            by_name[f"{joint}.{COULOMB}"] = own * (stage.friction[0] + sharper * stage.friction[1])
            by_name[f"{joint}.{SHARPNESS}"] = own * (mu * stage.friction[1] + stage.sharper) * by_sharpness
        return whitened, r, {**by_name, **stage.geometry}

    def response(self, values: Mapping[str, float]) -> Complex:
        """The response from torques to positions that the model has, dry friction as it seems, shape (l, nu, nu)."""
        return np.asarray(np.linalg.inv(self.with_friction(self.stiffness(values).Z, values, dry=True)))

    def log_errors(self) -> Complex:
        """Logarithm of the model's matrix over the measured one at the robot's values, shape (l, nu, nu)."""
        return np.asarray(np.log(self.response(self.robot.values) / self.pose.matrix.G[self.pose.used]))

    def logarithms(self, values: Mapping[str, float]) -> Whitened:
        """Logarithm of the model's matrix over the measured one, shape (l, nu, nu), as the balance above."""
        k, jw = self.stiffness(values), 1j * self.pose.w[:, None, None]
        G = np.linalg.inv(self.with_friction(k.Z, values, dry=True))

        def whitened(columns: Complex) -> Complex:
            return np.asarray(np.moveaxis((self.stage.whiten * columns).reshape(len(columns), len(G), -1), 0, 2))

        by_name: dict[str, Complex] = {}
        for spring, by in zip(self.arm.springs, k.by_spring, strict=True):
            column = -(G @ by @ G) / G
            by_name |= {spring.stiffness: column, spring.damping: jw * column}
        for i, joint in enumerate(self.arm.joints):
            column = -jw * (G[:, :, i, None] * G[:, i, None, :]) / G
            by_name |= {f"{joint}.{VISCOUS}": column, f"{joint}.{COULOMB}": np.asarray(self._seeming * column)}
            by_name[f"{joint}.{INERTIA}"] = np.asarray(jw * column)
        return whitened, np.log(G / self.pose.matrix.G[self.pose.used]), by_name

    @property
    def _seeming(self) -> float:
        """Viscous friction that dry friction of unit size seems to be under a sine, 2 / (pi v) [1/(rad/s)]."""
        pose = self.pose
        speed = 2.0 * np.abs(pose.carrier) * 2.0 * np.pi * pose.found.excitation.carrier
        return float(2.0 / (np.pi * np.mean(speed))) if pose.step else 0.0

    def sharpness(self, values: Mapping[str, float]) -> Array:
        """How sharply the dry friction of each motor turns over, shape (nu,) [s/rad]."""
        return np.array([self.robot.sharpness_of(joint, values) for joint in self.arm.joints])

    def _sharper(self, values: Mapping[str, float]) -> Array:
        """How far friction is from the stage's one, in derivatives by log k: it follows 1 / k once it turns sharply."""
        return np.asarray(1.0 - self.stage.sharpness / self.sharpness(values))

    def _each(self, values: Mapping[str, float], part: str) -> Array:
        return np.array([values.get(f"{joint}.{part}", 0.0) for joint in self.arm.joints])
