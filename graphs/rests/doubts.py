# SPDX-License-Identifier: BSD-3-Clause
"""What else would make rests far likelier: other weights, zeros, torques, friction that grows with what it carries.

The bands of friction are all that rigid joints have for witnesses. Friction is spread evenly over its band and knows
nothing of what the joint carries. If a band gets narrower by a factor r once k values more are free, the likelihood
grows by r^-n, and what evenly spread torques of n rests do by chance is

    p = P(R < r),   R ~ Beta(n - k, k)       [largest deviation over that around k fitted values]

exact for k = 1, a constant; the logarithm of it is half a chi2 of 2 k degrees of freedom where rests are many.

Springs have the encoders of their links, too, whose share of the fall is a chi2 of k degrees of freedom; the one of
2 k, which is larger, is asked of both together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, gammaincc

from jointscope.factors.calibration import Calibration
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.linear_rests import LinearRests
from jointscope.graphs.rests.rests_by_values import RestsByValues, SaidElsewhere
from jointscope.graphs.rests.taken_for_granted import all_rigid, at_null
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis, hypotheses_of
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
ASKED = ("link_mass", "load_scale", "encoder_offset", "torque_offset", "load_dependent_friction")
PLACE = "friction_by_angle"  # s (1 + a cos q + b sin q)
LIKELY = 1e-2  # probability of any of them by chance, that is none


@dataclass(frozen=True)
class Doubt:
    """A change of the model that rests ask for.

    Attributes:
        label: ID@OWNER of an effect, or PLACE@JOINT.
        fall: of chi2.
        p_value: by chance, of any that was asked.
        size: of the first value of the effect, in its unit.
    """

    label: str
    fall: float
    p_value: float
    size: float


@dataclass(frozen=True)
class AskedOfRests:
    """Rests, linearised with every effect that they are asked for at its null value.

    Attributes:
        linear: about the solution, by values.
        base: columns of the values of the model, shape (p,).
        groups: columns of the sizes of each effect, by label.
        rigid: whether bands are all that says anything.
    """

    linear: LinearRests
    base: NDArray[np.intp]
    groups: Mapping[str, NDArray[np.intp]]
    rigid: bool

    @staticmethod
    def of(
        problem: RestSet, robot: Robot, x: Array, calibration: Calibration, elsewhere: SaidElsewhere | None = None
    ) -> AskedOfRests | None:
        """None where no band says anything.

        Args:
            problem: all rests with their weights.
            robot: with the priors.
            x: states of largest likelihood, shape (m, d).
            calibration: values there.
            elsewhere: what other recordings say, in place of priors.
        """
        tried = [h for h in hypotheses_of(robot, at_rest=True) if h.here.effect.id in ASKED]
        by_values = RestsByValues.of(problem, at_null(robot, tried), x, calibration, elsewhere)
        if not len(by_values.linear.motor):
            return None
        groups = {h.label: _columns(h, by_values.calibration.names) for h in tried}
        rigid, linear = all_rigid(robot), by_values.linear
        if rigid:
            linear, places = _by_angle(linear, problem, robot)
            groups |= places
        return AskedOfRests(linear, np.arange(len(calibration.names)), groups, rigid)

    def doubts(self) -> tuple[Doubt, ...]:
        """All that is no chance, least likely first, then what takes fewer values for it."""
        least, found, sizes = self.linear.minimum(self.base)[1], [], dict[str, int]()
        for label, columns in self.groups.items():
            n, k = self.told(columns)
            if 0 < k < n:
                d, cost = self.linear.minimum(np.concatenate([self.base, columns]))
                sizes[label] = k
                fall, size = max(2.0 * (least - cost), 0.0), float(d[len(self.base)])
                chance = betainc(n - k, k, np.exp(-0.5 * fall / n)) if self.rigid else gammaincc(k, 0.5 * fall)
                found.append(Doubt(label, fall, float(chance), size))
        counted = [replace(doubt, p_value=min(len(found) * doubt.p_value, 1.0)) for doubt in found]
        return tuple(
            sorted((d for d in counted if d.p_value < LIKELY), key=lambda d: (d.p_value, sizes[d.label], -d.fall))
        )

    def told(self, columns: NDArray[np.intp]) -> tuple[int, int]:
        """Rests of the motor with most of them, and combinations of values that shift bands beyond chance.

        Where links have encoders of their own, all rests and all values.
        """
        linear = self.linear
        if not self.rigid:
            return len(linear.motor) + len(columns), len(columns)
        size = 1.0 / np.sqrt(np.diag(linear.A)[columns])
        rows = np.vstack([linear.Y[:, columns], linear.H[:, columns]]) * size / np.tile(linear.half, 2)[:, None]
        seen = np.any(rows != 0.0, axis=1).reshape(2, -1).any(axis=0)
        if not seen.any():
            return 0, 0
        n = int(np.bincount(linear.motor[seen]).max())
        return n, int(np.sum(np.linalg.svd(rows, compute_uv=False) > n**-0.5))


def _columns(hypothesis: EffectHypothesis, names: tuple[str, ...]) -> NDArray[np.intp]:
    return np.array([names.index(hypothesis.here.parameter(size.name)) for size in hypothesis.sizes], dtype=np.intp)


def _by_angle(linear: LinearRests, problem: RestSet, robot: Robot) -> tuple[LinearRests, dict[str, NDArray[np.intp]]]:
    """Bands that are wider at some angles of their own joint, as two more values of each."""
    counts = problem.rests.moved & (problem.rests.creep == 0.0)
    angle, H = problem.rests.q_motor[counts], [linear.H]
    places: dict[str, NDArray[np.intp]] = {}
    for j in np.unique(linear.motor).tolist():
        own = (linear.motor == j) * linear.half
        places[f"{PLACE}@{robot.joints[j]}"] = linear.H.shape[1] + 2 * len(places) + np.arange(2)
        H.append(np.column_stack([own * np.cos(angle), own * np.sin(angle)]))
    more = 2 * len(places)
    A = np.eye(len(linear.b) + more)
    A[:-more, :-more] = linear.A
    Y, G = (np.hstack([part, np.zeros((len(part), more))]) for part in (linear.Y, linear.G))
    return replace(linear, A=A, b=np.append(linear.b, np.zeros(more)), Y=Y, H=np.hstack(H), G=G), places
