# SPDX-License-Identifier: BSD-3-Clause
"""Shaken poses linearised at a calibrated arm: what every value, and every effect that is not there, would do.

Columns of effects are those of the torque balance of the robot that has them at their null value. A spring that is not
there has its resonance among the lines, where no slope at null tells of it: its column is the change of the balance by
a whole spring, on a grid of stiffnesses, over its compliance.

Neighbouring lines have causes in common, which the residuals show: slopes of bands make the covariance S of the whole
slope, and the information that counts is A S^-1 A, as in `FrequencySummary`. The residuals are those that the columns
leave, an effect's own included: an effect that matters would else count as the noise that hides it, and may come out
with the wrong sign. Folds are realisations of each pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.frequency.frequency_set import BAND, FrequencySet
from jointscope.graphs.frequency.stages import with_columns
from jointscope.robots.geometry.added_effect import RIGID, at_null
from jointscope.robots.geometry.arm_effects import FREQUENCY, ArmHypothesis
from jointscope.robots.geometry.flexible_arm import LOSS
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
STIFFNESSES = tuple(float(k) for k in np.geomspace(4e3, 1e6, 15))  # [N m/rad] of springs that may be missing
TOLD = 1e-9  # of the largest information: directions with less are not told
ALONE = 10  # folds of bands, where there is one realisation of one pose


@dataclass(frozen=True)
class LinearResponses:
    """Whitened rows of all shaken poses (`LinearKind`).

    Attributes:
        r: shape (n,) [sigma].
        J: columns of the values, and of nothing for what only poses have, shape (n, p).
        fold_of: number of the fold of each row, shape (n,).
        band: number of the band of neighbouring lines of each row, shape (n,).
    """

    r: Array
    J: Array
    fold_of: NDArray[np.intp]
    band: NDArray[np.intp]

    kind = FREQUENCY

    @property
    def folds(self) -> int:
        """Number of folds."""
        return int(self.fold_of.max()) + 1

    @property
    def counted(self) -> float:
        """Number of measured values, of which a band has one cause."""
        return len(self.r) / BAND

    def equations(self, extra: Array, out: int | None = None) -> tuple[Array, Array]:
        """As `LinearKind` says."""
        if extra.size and self._latest[0] is not extra:
            self._latest[:] = [extra, np.hstack([self.J, extra]), {}]
        wide, known = (self._latest[1], self._latest[2]) if extra.size else (self.J, self._plain)
        if out not in known:
            known[out] = self._balanced(wide, self.fold_of != out if out is not None else None)
        found: tuple[Array, Array] = known[out]
        return found

    def _balanced(self, wide: Array, kept: NDArray[np.bool_] | None) -> tuple[Array, Array]:
        """Information that counts and slope of the cost, of all rows or of those that are kept."""
        r, used = (self.r, wide) if kept is None else (self.r[kept], wide[kept])
        A, slope = used.T @ used, used.T @ r
        unit = np.sqrt(np.maximum(np.diag(A), 1e-300))
        size, V = np.linalg.eigh(A / np.outer(unit, unit))
        told = size > TOLD * size[-1]
        root = V[:, told] / np.sqrt(size[told]) / unit[:, None]  # A^-1/2 on what is told
        half = V[:, told] * np.sqrt(size[told]) * unit[:, None]
        slope = root.T @ slope
        left = self.r - wide @ (root @ slope)  # what all columns together leave: what they ask for is no noise
        left = left if kept is None else left * kept
        bands = np.add.reduceat(wide * left[:, None], self._begins, axis=0) @ root
        common, U = np.linalg.eigh(bands.T @ bands)
        inverse = (U / np.maximum(common, 1.0)) @ U.T
        return half @ inverse @ half.T, half @ (inverse @ slope)

    @cached_property
    def _begins(self) -> NDArray[np.intp]:
        """First row of each band."""
        return np.flatnonzero(np.diff(self.band, prepend=-1))

    @cached_property
    def _plain(self) -> dict[int | None, tuple[Array, Array]]:
        """Equations without other columns, by the fold that is left out."""
        return {}

    @cached_property
    def _latest(self) -> list[Any]:
        """The columns that were asked for last, all columns, and their equations: folds ask one after the other."""
        return [None, self.J, {}]

    def left_out(self, extra: Array, step: Array, fold: int) -> float:
        """As `LinearKind` says."""
        held = self.fold_of == fold
        return float(np.sum((self.r[held] + self._wide(extra)[held] @ step) ** 2))

    def _wide(self, extra: Array) -> Array:
        return np.hstack([self.J, extra]) if extra.size else self.J


class ResponseColumns:
    """Columns of effects in shaken poses.

    Args:
        robot: as calibrated.
        problems: the poses at their last stage.
        effects: that it lacks.
    """

    def __init__(self, robot: Robot, problems: Sequence[FrequencySet], effects: Sequence[ArmHypothesis]):
        own = robot.frequency
        assert own is not None
        seen = [h for h in effects if FREQUENCY not in h.kind.unseen]
        self._robot = at_null(robot, seen)
        self._problems = [with_columns(problem, self._robot) for problem in problems]
        self._names = Calibration.of(robot).names
        at = Calibration.of(self._robot).only([DYNAMICS])
        self._rows = [problem.rows(at) for problem in self._problems]
        self._place = {name: i for i, name in enumerate(at.names)}
        self._by_value = at.value_by_coordinate

    def linear(self, more: int) -> LinearResponses:
        """The poses as they are; `more` columns stand for what only other kinds have."""
        J = np.concatenate([J[..., [self._place[n] for n in self._names]].reshape(-1, len(self._names))
                            for _, J in self._rows])  # fmt: skip
        r = np.concatenate([r.reshape(-1) for r, _ in self._rows])
        fold, band, folds, bands = [], [], 0, 0
        alone = len(self._problems) == 1 and len(np.unique(self._problems[0].pose.found.realisations)) == 1
        for problem, (own, _) in zip(self._problems, self._rows, strict=True):
            lines = np.arange(len(own)) // BAND
            if alone:
                which = np.broadcast_to((lines % ALONE)[:, None], own.shape)
            else:
                _, numbers = np.unique(problem.pose.found.realisations, return_inverse=True)
                which = np.broadcast_to(np.resize(numbers, own.shape[1]), own.shape)
            fold.append(folds + which.reshape(-1))
            band.append(bands + np.repeat(lines, own.shape[1]))
            folds, bands = int(fold[-1].max()) + 1, int(band[-1].max()) + 1
        J = np.hstack([J, np.zeros((len(J), more))])
        return LinearResponses(r, J, np.concatenate(fold).astype(np.intp), np.concatenate(band).astype(np.intp))

    def of(self, hypothesis: ArmHypothesis, stiffness: float | None = None) -> Array:
        """Whitened columns of an effect, shape (n, k).

        Args:
            hypothesis: the effect.
            stiffness: of a spring, by which it is taken as a whole [N m/rad]; None for the slope at null.
        """
        if hypothesis.kind.soft and stiffness is not None:
            return np.stack([self._whole(name, stiffness) for name in hypothesis.names], axis=1)
        places = [self._place[name] for name in hypothesis.names]
        scale = -(RIGID**2) if hypothesis.kind.soft else 1.0
        found = [J[..., places].reshape(-1, len(places)) for _, J in self._rows]
        return np.concatenate(found) * scale / self._by_value[places]

    def _whole(self, name: str, stiffness: float) -> Array:
        """Change of the rows by a whole spring over its compliance, shape (n,)."""
        damper = self._damper[name]
        own = {name: stiffness, damper: LOSS * stiffness}
        columns = []
        for before, (Z, moved, W) in zip(self._problems, self._balances, strict=True):
            change = before.stiffness({**before.stage.values, **own}).Z - Z
            found = (W @ (change @ moved)).reshape(len(W), -1) * np.sqrt(2.0)
            columns.append(np.concatenate([found.real, found.imag], axis=1).reshape(-1))
        return np.concatenate(columns) * stiffness

    @cached_property
    def _damper(self) -> dict[str, str]:
        return {spring.stiffness: spring.damping for spring in self._problems[0].arm.springs}

    @cached_property
    def _balances(self) -> list[tuple[Complex, Complex, Complex]]:
        """Stiffness, motion that the torques predict, and what whitens torques, of each pose."""
        found = []
        for problem in self._problems:
            values = dict(problem.stage.values)
            k = problem.stiffness(values)
            inverse = np.linalg.inv(problem.with_friction(k.Z, values))
            turns = problem.pose.motion[:, problem.pose.lines].transpose(1, 2, 0)
            moved = turns - inverse @ problem.torque_balance(values, k).transpose(1, 2, 0)
            found.append((k.Z, moved, np.asarray(problem.stage.whiten @ inverse)))
        return found
