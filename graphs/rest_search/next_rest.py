# SPDX-License-Identifier: BSD-3-Clause
"""Which rest to add: the posture and the weight that would tell most of a value that is hardly known.

Candidates are postures on a grid within the limits of the joints, with the weights that hung on the arm and with none.
The model that was found says where motors and springs stand there. With C, the covariance that was found, and P, the
rows of a candidate without its own states,

    variance after = v' C v - w' (1 + P C P')^-1 w,    w = P C v,    v = derivative of what is asked

Postures count only if drives can hold them (efforts of the URDF; without these, commands that the rests have had), and
springs that are no straight line deflect no farther than they have.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product, zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.calibration.found_values import derived_value
from jointscope.graphs.rest_search.rest_candidates import candidate_rows, loads_tried, postures, rounded
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.calibrate_rests import RestCalibration
from jointscope.graphs.rests.taken_for_granted import unsure
from jointscope.robots.parts.relative_sigma import KNOWN

Array = NDArray[np.float64]

LOOSE = 0.05  # share of a value that its sigma must be to be looked at
ASKED, TOLD = 15, 3  # values that are tried, the least known first, and that are told
HELPS = 0.85  # times its sigma that a value must have after ten such rests
AS_GOOD = 1.25  # times the sigma that a posture nearer to the usual one may leave
REPEATS = 10
MASS, SPRING, CURVE = ".link_mass.", ".stiffness", ".spring_"


@dataclass(frozen=True)
class NextRest:
    """A rest that would tell most of a value.

    Attributes:
        name: of a parameter or a derived result.
        share: its sigma over its value now.
        after, after_ten: the same with this rest, and with ten of them.
        posture: of each joint of the robot [rad, of slides m].
        matters: joints whose angle matters; others may stand as at most rests.
        link: that the load hangs on; "" without any.
        force: of the load in the axes of the base, shape (3,) [N].
    """

    name: str
    share: float
    after: float
    after_ten: float
    posture: dict[str, float]
    matters: tuple[str, ...]
    link: str
    force: Array

    def to_json(self) -> dict[str, Any]:
        """For machines."""
        load = {"link": self.link, "force": self.force.tolist()} if self.link else None
        return {
            "name": self.name,
            "relative_sigma": self.share,
            "after_one": self.after,
            "after_ten": self.after_ten,
            "posture": self.posture,
            "matters": list(self.matters),
            "load": load,
        }


def next_rests(result: RestCalibration) -> tuple[NextRest, ...]:
    """Rests that would tell most of the values that are least known, one for each; none where all are known.

    Args:
        result: a calibration from rests, alone or with other kinds.
    """
    asked = _hardly_known(result)
    if not asked:
        return ()
    search = _Search.of(result)
    found: list[NextRest] = []
    for name, share in _in_turn(asked, result)[:ASKED]:
        best = search.best(name, share) if len(found) < TOLD else None
        if best is not None:
            found.append(best)
    return tuple(found)


def _in_turn(asked: list[tuple[str, float]], result: RestCalibration) -> list[tuple[str, float]]:
    """Weights, springs and friction in turn, the least known of each first: friction alone would fill the list."""
    gravity = {d.name for d in result.robot.derived if d.gravity}

    def kind(name: str) -> int:
        return 0 if name in gravity or MASS in name else 1 if name.endswith(SPRING) or CURVE in name else 2

    by_kind = [[each for each in asked if kind(each[0]) == k] for k in range(3)]
    return [each for turn in zip_longest(*by_kind) for each in turn if each is not None]


def _hardly_known(result: RestCalibration) -> list[tuple[str, float]]:
    """Values and their relative sigmas, the least known first; derived ones that are a parameter in other words not."""
    derived, found = {d.name: d for d in result.robot.derived}, {}
    for p in (*result.parameters, *result.derived):
        own = derived.get(p.name)
        size = abs(p.value) if own is None or own.gravity else 0.0
        if own is None and not result.robot.parameters[p.name].positive:
            size = 0.0 if any(d.gravity for d in derived.values()) else _mass_of(result, p.name)
        if size > 0.0 and p.sigma > LOOSE * size:
            found[p.name] = float(p.sigma / size)
    return sorted(found.items(), key=lambda pair: -pair[1])


def _mass_of(result: RestCalibration, name: str) -> float:
    """Mass of the link of a mass error [kg]; zero of other values of either sign, which may be nothing."""
    if not name.endswith(f"{MASS}mass"):
        return 0.0
    model = result.robot.tree.model
    return float(model.inertias[model.getJointId(name.partition(MASS)[0])].mass)


@dataclass(frozen=True)
class _Search:
    """Candidates with their rows.

    Attributes:
        problem: all rests of the robot that was found, with masses and loads in doubt where rests cannot tell them.
        calibration: its values.
        known: covariance that was found, with masses and loads in doubt, shape (p, p).
        q: postures, shape (c, n).
        forces, links: loads of the candidates.
        P: rows without states, shape (c, k, p); zero where the robot cannot stand.
        usual: median posture of the rests, shape (n,).
    """

    problem: RestSet
    calibration: Calibration
    known: Array
    q: Array
    forces: Array
    links: tuple[str, ...]
    P: Array
    usual: Array

    @staticmethod
    def of(result: RestCalibration) -> _Search:
        whole = RestSet.joined(result.problems)
        robot = unsure(result.robot, whole.rests)
        whole = whole.of_robot(robot)
        calibration = Calibration.of(robot).only([DYNAMICS])
        priors = np.array([robot.parameters[name].coordinate_sigma for name in calibration.names])
        known, count = np.diag(priors**2), len(result.covariance)
        scale = calibration.value_by_coordinate[:count]
        known[:count, :count] = result.covariance / np.outer(scale, scale)
        x = np.vstack(result.states)
        seen = x[:, whole.places(robot.layout.joint_q)]
        q, loads = postures(whole, seen), loads_tried(whole.rests)
        together = list(product(range(len(q)), range(len(loads))))
        at, hung = np.array([i for i, _ in together]), [loads[k] for _, k in together]
        forces, links = np.array([force for _, force in hung]), tuple(link for link, _ in hung)
        P = candidate_rows(whole, calibration, known, x, q[at], forces, links)
        return _Search(whole, calibration, known, q[at], forces, links, P, np.median(seen, axis=0))

    def best(self, name: str, share: float) -> NextRest | None:
        """The candidate that tells most of a value; None where none tells enough."""
        v = self._slopes(name)
        if v @ self.known @ v <= 0.0:
            return None
        left = self._left(self.P, v, REPEATS)
        best = int(np.argmin(left))
        if left[best] > HELPS:
            return None
        if share * left[best] > KNOWN:
            return None
        q, matters, P = self.q[best].copy(), [], self.P[best : best + 1]
        good = AS_GOOD * float(left[best])
        for j, joint in enumerate(self.problem.robot.joints):
            plain = q.copy()
            plain[j] = rounded(self.usual[j], joint in self.problem.robot.tree.slides)
            rows = self._rows_at(plain, best)
            if self._left(rows, v, REPEATS)[0] <= good:
                q, P = plain, rows
            else:
                matters.append(joint)
        one, ten = (float(share * self._left(P, v, times)[0]) for times in (1, REPEATS))
        posture = dict(zip(self.problem.robot.joints, q.tolist(), strict=True))
        return NextRest(name, share, one, ten, posture, tuple(matters), self.links[best], self.forces[best])

    def _rows_at(self, q: Array, like: int) -> Array:
        x = np.zeros((0, len(self.problem.robot.layout.positions)))
        some = self.forces[like : like + 1], (self.links[like],)
        return candidate_rows(self.problem, self.calibration, self.known, x, q[None], *some)

    def _slopes(self, name: str) -> Array:
        """Derivative of a value by the coordinates, shape (p,)."""
        robot, scale = self.problem.robot, self.calibration.value_by_coordinate
        derived = next((d for d in robot.derived if d.name == name), None)
        by = {name: 1.0} if derived is None else derived_value(robot, derived, robot.values)[1]
        return np.array([by.get(each, 0.0) for each in self.calibration.names]) * scale

    def _left(self, P: Array, v: Array, times: int) -> Array:
        """Sigma of a value after so many rests of each candidate, over that before, shape (c,)."""
        PC = P @ self.known
        w = PC @ v
        S = np.eye(P.shape[1]) / times + PC @ np.swapaxes(P, 1, 2)
        gain = np.einsum("ck,ck->c", w, np.linalg.solve(S, w[:, :, None])[:, :, 0])
        return np.asarray(np.sqrt(np.maximum(1.0 - gain / (v @ self.known @ v), 1e-12)))
