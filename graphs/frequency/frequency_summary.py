# SPDX-License-Identifier: BSD-3-Clause
"""What frequency responses tell of the shared values, as one Gaussian factor that holds what is in doubt.

With slopes g = J'r and information A = J'J of the whitened residuals at some values, the slope has not the covariance A
that white residuals give it, but S, which in coordinates where A is one is one and more:

- where bands of neighbouring lines have one cause, what they have in common;
- in the directions of the friction what periods show: noise of a velocity that turns over is a push, and comes back at
  all lines;
- what friction does above the band of the velocities. Halves of the band differ by ever less, by a factor rho, each in
  another direction, so that all above it adds up to the last difference over the root of rho^2 - 1.

The values that the responses alone prefer then have the information

    M = A S^-1 A  <=  A

A kind that is added this way never widens what others tell. A Gauss-Newton step finds these preferred values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.frequency.frequency_set import FrequencySet
from jointscope.graphs.solving.normal_equations import NormalEquations
from jointscope.robots.files.sections.frequency_section import COULOMB
from jointscope.robots.model.robot import SHARPNESS, Robot

Array = NDArray[np.float64]
DRY = (COULOMB, SHARPNESS)  # parameters of the dry friction
LEAST_FALL = np.sqrt(2.0)  # of what half of the band is worth, from half to half
TOLD = 1e-9  # of the largest eigenvalue, in prior sigmas: directions with less information are not told


@dataclass(frozen=True)
class FrequencySummary:
    """The factor (`SetProblem`); it has no states of its own.

    Attributes:
        robot: the model.
        names: of the dynamic parameters that M is of, shape (p,); a robot may have others beside.
        information: M, shape (p, p).
        preferred: coordinates of these parameters that the responses alone prefer, shape (p,).
        measured: number of measured values that it stands for.
        problems: the poses at the stage at which they were linearised.
        owner: None, it is whole.
    """

    robot: Robot
    names: tuple[str, ...]
    information: Array
    preferred: Array
    measured: int
    problems: tuple[FrequencySet, ...] = ()
    owner: int | None = None

    kind: str = field(default="frequency", init=False)
    priors: tuple[()] = field(default=(), init=False)

    @staticmethod
    def of(problems: Sequence[FrequencySet], calibration: Calibration, apart: bool = False) -> FrequencySummary:
        """Summary of poses at their last stage.

        Args:
            problems: the poses.
            calibration: values that were found, of blocks that they touch.
            apart: whether these recordings may prefer other values, as a part of those that found these: what all their
                bands have in common is then no doubt, but what they ask for.
        """
        robot = problems[0].robot
        unit = np.array([robot.parameters[name].coordinate_sigma for name in calibration.names])
        systems = [problem.linearize(np.zeros((0, 1)), calibration) for problem in problems]
        A = np.sum([system.C for system in systems], axis=0) * np.outer(unit, unit)
        g = np.sum([system.g_p for system in systems], axis=0) * unit
        size, V = np.linalg.eigh(A)
        told = size > TOLD * size[-1]
        root = V[:, told] / np.sqrt(size[told])  # A^-1/2 on what is told
        slopes = [problem.slopes(calibration) for problem in problems]
        bands = np.vstack([_about_mean(part) for part in slopes] if apart else slopes) * unit @ root
        half = V[:, told] * np.sqrt(size[told])
        common, U = np.linalg.eigh(bands.T @ bands)
        doubt = _doubt(problems, calibration, unit, root)
        S = (U * np.maximum(common, 1.0)) @ U.T + np.outer(doubt, doubt)
        friction = [i for i, name in enumerate(calibration.names) if name.endswith(DRY)]
        S += _pushes(
            np.vstack([problem.noise_slopes(calibration) for problem in problems]) * unit @ root, half[friction]
        )
        M = half @ np.linalg.solve(S, half.T)
        preferred = calibration.dynamics - unit * (root @ (root.T @ g))
        count = sum(problem.measured for problem in problems)
        return FrequencySummary(robot, calibration.names, M / np.outer(unit, unit), preferred, count, tuple(problems))

    def without_friction(self) -> FrequencySummary:
        """What the responses tell where their dry friction may be another one than that of the other kinds.

        Noise of velocities rounds the friction off that responses see, so their size of it is some tenths of a per cent
        too large, 2 to 3 of its sigmas; held to that of a motion, which knows it better, springs would bend to it.
        """
        dry = np.array([name.endswith(DRY) for name in self.names])
        M = self.information
        told = M[np.ix_(~dry, dry)] @ np.linalg.pinv(M[np.ix_(dry, dry)], hermitian=True)
        less = np.zeros_like(M)
        less[np.ix_(~dry, ~dry)] = M[np.ix_(~dry, ~dry)] - told @ M[np.ix_(dry, ~dry)]
        return replace(self, information=less)

    def of_robot(self, robot: Robot) -> FrequencySummary:
        """The same responses of a robot with other values."""
        return replace(self, robot=robot)

    def start(self, common: Calibration) -> tuple[Array, Calibration]:
        """No states."""
        return np.zeros((0, 1)), common.only([DYNAMICS])

    def linearize(self, x: Array, calibration: Calibration) -> NormalEquations:
        """Normal equations of the shared values."""
        return NormalEquations.gaussian(calibration, self.names, self.preferred, self.information)


def _about_mean(bands: Array) -> Array:
    """Slopes of bands, shape (b, p), without what they have in common."""
    b = len(bands)
    return np.asarray((bands - bands.mean(axis=0)) * np.sqrt(b / max(b - 1, 1)))


def _pushes(noise: Array, friction: Array) -> Array:
    """What noise adds to S in the directions of friction.

    Args:
        noise: slopes by it, shape (s, m).
        friction: these directions, shape (f, m).
    """
    Q = np.linalg.qr(friction.T)[0]
    size, U = np.linalg.eigh(Q.T @ noise.T @ noise @ Q)
    return np.asarray((Q @ U * np.maximum(size - 1.0, 0.0)) @ (Q @ U).T)


def _doubt(problems: Sequence[FrequencySet], calibration: Calibration, unit: Array, root: Array) -> Array:
    """Slope that all friction above the band of the velocities may add, shape (m,)."""
    last, before = (sum(p.doubt(calibration, share) for p in problems) * unit @ root for share in (1.0, 0.5))
    size = float(np.linalg.norm(last))
    fall = max(float(np.linalg.norm(before)) / size, LEAST_FALL) if size > 0.0 else LEAST_FALL
    return np.asarray(last / np.sqrt(fall**2 - 1.0))
