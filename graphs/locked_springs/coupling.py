# SPDX-License-Identifier: BSD-3-Clause
"""The transmission that recordings with locked springs show, against that of the robot file, and as its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.locked_springs.coupling_matrix import CouplingFit, fit_coupling
from jointscope.graphs.locked_springs.deflections import check_locked
from jointscope.graphs.locked_springs.locked_readings import LockedReadings
from jointscope.graphs.locked_springs.locked_set import LockedSet
from jointscope.graphs.screening.transmission_evidence import stated_matrix
from jointscope.robots.dynamics.transmission import elements
from jointscope.robots.effect_kinds.transmission_elements import FROM
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.sections.transmission_section import WORST_CONDITION, element_units
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import Parameter

Array = NDArray[np.float64]

NOTHING = 1e-9  # of the largest element, which inverting a matrix leaves of zero
OTHER_SIGMAS, OTHER_SHARE = 4.0, 5e-3  # from which an element is another one than the file's: both must be exceeded
WIDE = 10.0  # times the element, or a tenth of the largest: the prior's sigma


@dataclass(frozen=True)
class Coupling:
    """A transmission as locked springs show it.

    Attributes:
        robot: as its file has it.
        matrix, sigmas: joint angles per motor angle, and how well they are known, shape (n, n); a sigma of zero where
            nothing was looked for, or zero was found.
        stated: matrix of the file, shape (n, n).
        fits: of recordings with the same locked joints.
    """

    robot: Robot
    matrix: Array
    sigmas: Array
    stated: Array
    fits: tuple[CouplingFit, ...]

    @property
    def others(self) -> list[tuple[int, int]]:
        """Elements that are others than the file's."""
        away = np.abs(self.matrix - self.stated)
        floor = OTHER_SHARE * np.abs(self.matrix).max(axis=1)[:, None]
        return [(int(i), int(j)) for i, j in np.argwhere((away > OTHER_SIGMAS * self.sigmas) & (away > floor))]

    @property
    def pasted(self) -> str:
        """The section as a robot file has it."""
        rows = ", ".join(
            f"[{', '.join(self._digits(i, j) for j in range(len(row)))}]" for i, row in enumerate(self.matrix)
        )
        return f"transmission: {{matrix: [{rows}]}}"

    def _digits(self, i: int, j: int) -> str:
        value, sigma = self.matrix[i, j] + 0.0, self.sigmas[i, j]
        if sigma <= 0.0:
            return f"{value:.9g}"
        return f"{value:.{max(0, 1 - int(np.floor(np.log10(sigma))))}f}"

    def element(self, i: int, j: int) -> str:
        """Name of an element as a parameter."""
        return f"{self.robot.joints[i]}.{FROM}{self.robot.joints[j]}"

    def sentence(self) -> str | None:
        """What is wrong in the file, with what to write; None where it is right."""
        others = self.others
        if not others:
            return None
        said = ", ".join(
            f"{self.element(i, j)} is {self.matrix[i, j]:.6g} +- {self.sigmas[i, j]:.2g} "
            f"(file: {self.stated[i, j]:.6g})"
            for i, j in others
        )
        turned = [
            joint
            for i, joint in enumerate(self.robot.joints)
            if self.sigmas[i, i] > 0.0 and abs(self.matrix[i, i]) < OTHER_SIGMAS * self.sigmas[i, i]
        ]
        names = (
            f"; {', '.join(turned)} not turned by its own motor: check `names` of both encoders first" if turned else ""
        )
        where = ", ".join(r.path for fit in self.fits for r in fit.readings)
        return (
            f"{where}: the transmission of {robot_argument(self.robot)} is not that of its locked springs: {said}; "
            f"write `{self.pasted}` (joint angles = matrix times motor angles){names}"
        )

    def to_json(self) -> dict[str, Any]:
        """For machines."""
        joints = self.robot.joints
        return {
            "matrix": self.matrix.tolist(),
            "sigmas": self.sigmas.tolist(),
            "stated": self.stated.tolist(),
            "differs": [self.element(i, j) for i, j in self.others],
            "zero": [
                f"{joints[row]}, {joints[column]}"
                for fit in self.fits
                for k, row in enumerate(fit.readings[0].rows.tolist())
                for column in np.flatnonzero(~fit.free[k] & ~fit.readings[0].still).tolist()
            ],
            "locked": {
                r.path: {
                    "joints": list(r.joints),
                    "instants": len(r),
                    "link_delay": fit.delays[i],
                    "rms": dict(zip(r.joints, fit.rms.tolist(), strict=True)),
                    "explained": dict(zip(r.joints, fit.explained.tolist(), strict=True)),
                }
                for fit in self.fits
                for i, r in enumerate(fit.readings)
            },
        }

    def of_robot(self) -> Robot:
        """The robot with this matrix, whose elements a calibration looks for; those that its file holds stay.

        An element that an effect adds stays one of that effect.
        """
        robot = self.robot
        own, added = elements(robot)
        fixed = np.eye(robot.n) if robot.transmission is None else robot.transmission
        by_effect = {at: name for name, at in added.items()}
        by_own = {at: name for name, at in own.items()}
        T, parameters, units = fixed.copy(), dict(robot.parameters), element_units(robot)
        largest = float(np.abs(self.matrix).max())
        for i, j in np.argwhere((self.sigmas > 0.0) | (self.matrix != self.stated)).tolist():
            value, prior = float(self.matrix[i, j]), float(self.stated[i, j])
            name = by_effect.get((i, j), by_own.get((i, j), self.element(i, j)))
            old = parameters.get(name)
            if old is not None and old.fixed:
                continue
            if (i, j) in by_effect:
                parameters[name] = replace(robot.parameter(name), value=value - float(fixed[i, j]))
                continue
            T[i, j] = value
            if self.sigmas[i, j] <= 0.0:
                if old is not None:
                    parameters[name] = replace(old, value=value)
                continue
            wide = WIDE * max(abs(value), 0.1 * largest)
            new = Parameter(name, value, units[name], prior, wide, positive=False)
            parameters[name] = new if old is None else replace(old, value=value)
        return replace(robot, transmission=T, parameters=parameters)

    def to_parameters(self) -> dict[str, Parameter]:
        """The elements that locked springs alone show, as parameters of `of_robot` with their sigmas, by name."""
        found = self.of_robot()
        own, added = elements(found)
        return {
            name: replace(found.parameters[name], sigma=float(self.sigmas[at]))
            for name, at in {**own, **added}.items()
            if self.sigmas[at] > 0.0 and not found.parameters[name].fixed
        }

    def sets(self, robot: Robot) -> list[LockedSet]:
        """The recordings for a graph of that robot."""
        return [LockedSet(robot, readings, fit.widened) for fit in self.fits for readings in fit.readings]


def find_coupling(robot: Robot, readings: Sequence[LockedReadings]) -> Coupling:
    """The transmission of a robot from its recordings with locked springs.

    Args:
        robot: as its file has it.
        readings: of each recording.

    Raises:
        RecordingError: a spring deflects that is said to be locked, no transmission is like that, or none was found.
    """
    stated = stated_matrix(robot)
    A: Array = np.asarray(np.linalg.inv(stated), dtype=np.float64)
    fits = []
    variance = np.zeros((robot.n,) * 4)  # of elements of A, without zeros and delays
    groups = [[r for r in readings if r.joints == joints] for joints in dict.fromkeys(r.joints for r in readings)]
    for some in sorted(groups, key=lambda group: sum(map(len, group))):  # a row has what its longest recordings say
        fit = fit_coupling(some, A[some[0].rows])
        check_locked(fit, robot)
        _must_have_converged(fit, robot)
        A[some[0].rows] = fit.A
        told = np.zeros(A.shape, bool)
        told[np.ix_(some[0].rows, ~np.all([r.still for r in some], axis=0))] = True
        variance[told] = variance[:, :, told] = 0.0
        own, j = np.nonzero(fit.free)
        i = some[0].rows[own]
        variance[i[:, None], j[:, None], i, j] = fit.covariance[: len(i), : len(i)]
        fits.append(fit)
    if np.linalg.cond(A / np.linalg.norm(A, axis=0)) > WORST_CONDITION:
        raise RecordingError(
            f"{readings[0].path}: motors and links do not determine each other (singular matrix); check names, signs "
            f"and units of both encoders in {robot_argument(robot)}"
        )
    T: Array = np.asarray(np.linalg.inv(A), dtype=np.float64)
    T[np.abs(T) < NOTHING * np.abs(T).max()] = 0.0
    # T changes by -T dA T
    sigmas = np.sqrt(np.maximum(np.einsum("ia,bj,abcd,ic,dj->ij", T, T, variance, T, T), 0.0))
    return Coupling(robot, T, sigmas, stated, tuple(fits))


def _must_have_converged(fit: CouplingFit, robot: Robot) -> None:
    if not fit.converged:
        raise RecordingError(
            f"{fit.readings[0].path}: no matrix between motors and links was found (no convergence); check names, "
            f"signs and units of both encoders in {robot_argument(robot)}, and that joints move one after the other"
        )
