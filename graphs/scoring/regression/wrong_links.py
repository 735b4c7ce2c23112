# SPDX-License-Identifier: BSD-3-Clause
r"""Which link weighs something else than the URDF says, by regression of all joints together.

    k u = M a + c + g + (mass of one link: the same at all joints) + b a + d v + mu sign(v)

A heavier link shows in every joint that carries it, in the shape of its weight and of its acceleration. At one joint
alone that may look like an offset, a gain that falls or a dead band; together joints tell. Mass alone comes before mass
and first moments: a casting that is denser is what URDFs get wrong, and a load is elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.regression.evidence import evidence, nearly
from jointscope.graphs.scoring.regression.joint_regression import JointRows, changes_between, design_of, fit
from jointscope.graphs.scoring.wrong_masses import EFFECT
from jointscope.graphs.starts.windowed_sums import WIDTHS
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import cannot_be_added

Array = NDArray[np.float64]
Changes = dict[str, float]

TILT = "gravity_direction"  # which two sizes tell, where a mass at another place has four
LEFT = 0.25  # of the mean square that the plain regression leaves at the joint that tells most, which may be left
LARGE = 0.005  # of that drive's rms torque, from which what a mass explains matters to anybody ...
MOVED = 0.01  # ... or this share of a value, by which it must change one
SURE = 4.5  # [sigma], over some 20 blocks: one link in ten thousand by chance
ROUNDS = 3  # in which constants of drives are found with the mass
FEWEST_BLOCKS = 8


@dataclass(frozen=True)
class WrongLink:
    """A link that weighs something else.

    Attributes:
        joint: that moves it.
        mass, sigma: by which it is heavier [kg].
        share: the same, over what the URDF has.
        moments: first moments beside those that the mass has where the link is, (x, y, z) [kg m]; none for mass alone.
        alike: joints that move other links, of which one may be the wrong one as well.
        drives: whether drives that make more or less torque than they are asked for would explain as much.
        seen_at: the joint where it explains most.
        explained: share of the mean square there that the plain regression leaves.
        size: rms of what it explains there, over that of the drive.
        with_it: parameters with it over those without, by name.
        evidence: for it, over all joints.
    """

    joint: str
    mass: float
    sigma: float
    share: float
    moments: tuple[float, ...]
    alike: tuple[str, ...]
    drives: bool
    seen_at: str
    explained: float
    size: float
    with_it: Changes
    evidence: float


class _Rows(NamedTuple):
    """One joint's regression beside the columns of a link.

    Attributes:
        joint: index.
        rows: of the joint alone, of the effects that the robot has, and of the link, shape (w, 5 + e + k).
        blocks: of each window, shape (w,).
        width: how many columns the link has, k.
        plain: mean square that is left without the link.
        seconds: of motion that the windows tell of.
    """

    joint: int
    rows: Array
    blocks: NDArray[np.intp]
    width: int
    plain: float
    seconds: float

    def without(self, block: int) -> _Rows:
        """The same where a block of time is left out."""
        kept = self.blocks != block
        return self._replace(rows=self.rows[kept], blocks=self.blocks[kept])


class _Told(NamedTuple):
    """What windows of one width say of one link; sizes is one for the mass alone."""

    here: EffectHypothesis
    sizes: int
    some: list[_Rows]
    found: Array
    left: list[float]
    evidence: float


def wrong_link(rows: JointRows, tilted: float) -> WrongLink | None:
    """The link whose weight explains most, where it explains nearly all that is missing at a joint.

    Args:
        rows: of the regression.
        tilted: evidence for a base that is not level, as `tilted_base` finds it.
    """
    robot, effect = rows.robot, catalogue()[EFFECT]
    if not np.any(robot.tree.gravity):
        return None
    at = [EffectAt(effect, owner) for owner in effect.owners_of(robot) if not robot.has_effect(EFFECT, owner)]
    links = [EffectHypothesis(a, effect.parameters_at(robot, a.owner)) for a in at if not cannot_be_added(robot, a)]
    # nothing is asked of windows in which no joint lacks more than noise
    widths = [width for width in WIDTHS if any(rows.open_at(joint, width, LEFT) for joint in range(robot.n))]
    told = [one for link in links for width in widths for one in _of(rows, link, width, (1, len(link.sizes)))]
    if not told or max(one.evidence for one in told) <= 0.0:
        return None
    clearest = max(told, key=lambda one: one.evidence)
    least = clearest.evidence - nearly(max(one.seconds for one in clearest.some))
    # of those that are as good the simplest, and a mass is simpler than a mass at another place
    best = max((one for one in told if one.evidence >= least), key=lambda one: (-one.sizes, one.evidence))
    drives = _of_drives(rows, best)
    if drives > best.evidence or tilted > (best.evidence if best.sizes == 1 else least):
        return None
    return _sure(rows, best, [one for one in told if one.evidence >= least], drives >= least)


def tilted_base(rows: JointRows) -> float:
    """Evidence for weight in another direction, over all joints; zero where nothing tells of it.

    Args:
        rows: of the regression.
    """
    robot, here = rows.robot, EffectAt(catalogue()[TILT], "robot")
    if robot.has_effect(TILT, "robot") or cannot_be_added(robot, here):
        return 0.0
    tilt = EffectHypothesis(here, here.effect.parameters_at(robot, "robot"))
    told = [one for width in WIDTHS for one in _of(rows, tilt, width, (len(tilt.sizes),))]
    return max((one.evidence for one in told), default=0.0)


def _of_drives(rows: JointRows, best: _Told) -> float:
    """Evidence for drives that make less, or more, than they are asked for, where commands are torques."""
    found = 0.0
    for one in best.some:
        plain = one.rows[:, : -one.width]
        freed = fit(rows.robot, one.joint, plain, free_gain=True).left
        found += max(evidence(one.plain, freed, one.seconds, 1), 0.0)
    return found


def _of(rows: JointRows, link: EffectHypothesis, width: float, counts: tuple[int, ...]) -> list[_Told]:
    """What windows of one width [s] say of a link, by so many of its sizes: of its mass, and of its first moments."""
    all_columns = {joint: rows.columns(joint, link) for joint in range(rows.robot.n)}
    some = []
    for joint, columns in all_columns.items():
        if columns is not None:
            beside = rows.beside(joint, width, rows.with_own(joint, columns))
            if beside is not None:
                count = len(columns[0])
                plain = fit(rows.robot, joint, beside[0][:, :-count]).left
                some.append(_Rows(joint, *beside, count, max(plain, 1e-300), rows.seconds(width, len(beside[0]))))
    if not some:
        return []
    told = []
    for sizes in counts:
        kept = [one._replace(rows=one.rows[:, : one.rows.shape[1] - one.width + sizes], width=sizes) for one in some]
        found, left = _solved(rows, link, kept)
        worth = [evidence(one.plain, share, one.seconds, 0) for one, share in zip(kept, left, strict=True)]
        cost = evidence(1.0, 1.0, max(one.seconds for one in kept), sizes)
        told.append(_Told(link, sizes, kept, found, left, sum(worth) + cost))
    return told


def _solved(rows: JointRows, link: EffectHypothesis, some: Sequence[_Rows]) -> tuple[Array, list[float]]:
    """Sizes that all joints agree on, shape (k,), and the mean square that each joint leaves with them."""
    robot, count = rows.robot, some[0].width
    gains = [fit(robot, one.joint, one.rows[:, :-count]).gain for one in some]
    free = [fit(robot, one.joint, one.rows).left for one in some]
    prior = np.array([size.prior_sigma for size in link.sizes[:count]])
    sizes: Array = np.zeros(count)
    left = list[float]()
    for _ in range(ROUNDS):
        H, h = np.diag(1.0 / prior**2), np.zeros(count)
        for one, gain, square in zip(some, gains, free, strict=True):
            _, X, target = design_of(robot, one.joint, one.rows)
            own, columns = _unit(X[:, :-count]), X[:, -count:] / gain
            columns, target = columns - own @ (own.T @ columns), target - own @ (own.T @ target)
            H += columns.T @ columns / max(square, 1e-300)
            h += columns.T @ target / max(square, 1e-300)
        sizes, left, gains = np.asarray(np.linalg.solve(H, h)), [], list(gains)
        for i, one in enumerate(some):
            with_it = fit(robot, one.joint, _with(one, sizes))
            left.append(with_it.left)
            gains[i] = with_it.gain
    return sizes, left


def _unit(columns: Array) -> Array:
    """An orthonormal basis of some columns."""
    size = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300)
    basis, values, _ = np.linalg.svd(columns / size, full_matrices=False)
    return np.asarray(basis[:, values > 1e-10 * values[0]]) if values.size else columns


def _with(one: _Rows, sizes: Array) -> Array:
    """Rows of a joint whose link weighs what is found: its torque is a part of the load."""
    rows = one.rows[:, : -one.width].copy()
    rows[:, 1] += one.rows[:, -one.width :] @ sizes
    return rows


def _sure(rows: JointRows, best: _Told, as_good: Sequence[_Told], drives: bool) -> WrongLink | None:
    """The link as it is reported; None where it may be chance, is nothing that can be, or matters to nobody."""
    robot = rows.robot
    shares = [left / one.plain for left, one in zip(best.left, best.some, strict=True)]
    worth = [evidence(one.plain, left, one.seconds, 0) for left, one in zip(best.left, best.some, strict=True)]
    first = int(np.argmax(worth))
    seen, explained = best.some[first], 1.0 - shares[first]
    driving = float(np.mean(seen.rows[:, 0] ** 2))
    size = float(np.sqrt(max(explained, 0.0) * seen.plain / max(driving, 1e-300)))
    names = np.unique(np.concatenate([one.blocks for one in best.some]))
    if shares[first] > LEFT or len(names) < FEWEST_BLOCKS:
        return None
    others = [_solved(rows, best.here, [one.without(name) for one in best.some])[0] for name in names]
    sigmas = np.sqrt((len(names) - 1.0) * np.var(others, axis=0))
    body = robot.tree.model.inertias[robot.tree.model.getJointId(best.here.here.owner)]
    possible = body.mass + best.found[0] > -SURE * sigmas[0]
    if not possible or np.max(np.abs(best.found) / np.maximum(sigmas, 1e-300)) < SURE:
        return None
    with_it: Changes = {}
    for one in best.some:
        plain, found = fit(robot, one.joint, one.rows[:, : -one.width]), fit(robot, one.joint, _with(one, best.found))
        with_it |= changes_between(robot, robot.joints[one.joint], plain, found)
    if size < LARGE and max((abs(factor - 1.0) for factor in with_it.values()), default=0.0) < MOVED:
        return None
    alike = dict.fromkeys(one.here.here.owner for one in as_good if one.sizes <= best.sizes)
    alike.pop(best.here.here.owner, None)
    return WrongLink(
        joint=best.here.here.owner,
        mass=float(best.found[0]),
        sigma=float(sigmas[0]),
        share=float(best.found[0] / body.mass) if body.mass > 0.0 else np.inf,
        moments=tuple(best.found[1:].tolist()),
        alike=tuple(alike),
        drives=drives,
        seen_at=robot.joints[seen.joint],
        explained=explained,
        size=size,
        with_it=with_it,
        evidence=best.evidence,
    )
