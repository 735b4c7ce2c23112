# SPDX-License-Identifier: BSD-3-Clause
r"""Which link weighs something else than the URDF says, by regression of all joints together.

    k u = M a + c + g + (mass of one link: the same at all joints) + b a + d v + mu sign(v)

A heavier link shows in every joint that carries it, in the shape of its weight and of its acceleration. At one joint
alone that may look like an offset, a gain that falls or a dead band; together joints tell. Mass alone comes before mass
and first moments: a casting that is denser is what URDFs get wrong, and a load is elsewhere. A joint whose encoder
counts from another zero (`turned_joints`) competes, and so do several: weights behind them stand elsewhere, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.regression.evidence import evidence, nearly
from jointscope.graphs.scoring.regression.joint_regression import JointRows, changes_between, fit
from jointscope.graphs.scoring.regression.shared_columns import Told, solved, told_of, with_sizes
from jointscope.graphs.scoring.regression.torque_columns import TURN
from jointscope.graphs.scoring.regression.turned_joints import turned_joints
from jointscope.graphs.scoring.wrong_masses import EFFECT
from jointscope.graphs.starts.windowed_sums import WIDTHS
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import cannot_be_added
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
Changes = dict[str, float]

TILT = "gravity_direction"  # which two sizes tell, where a mass at another place has four
LEFT = 0.25  # of the mean square that the plain regression leaves at the joint that tells most, which may be left
LARGE = 0.005  # of that drive's rms torque, from which what a mass explains matters to anybody ...
MOVED = 0.01  # ... or this share of a value, by which it must change one
SURE = 4.5  # [sigma], over some 20 blocks: one link in ten thousand by chance
FEWEST_BLOCKS = 8


@dataclass(frozen=True)
class WrongLink:
    """A link that weighs something else, or stands otherwise behind its joint than the encoder says.

    Attributes:
        joint: that moves it.
        turn: what the joint's encoder reads too much [rad]; zero where the link's mass is meant.
        beside: other joints whose encoders have another zero as well, and what these read too much [rad].
        mass: by which it is heavier [kg].
        sigma: of that, or of the angle.
        share: the same, over what the URDF has.
        moments: first moments beside those that the mass has where the link is, (x, y, z) [kg m]; none for mass alone.
        alike: joints that move other links, of which one may be the wrong one as well.
        tilted: whether a base that is not level would explain as much.
        drives: whether drives that make more or less torque than they are asked for would explain as much.
        seen_at: the joint where it explains most.
        explained: share of the mean square there that the plain regression leaves.
        size: rms of what it explains there, over that of the drive.
        with_it: parameters with it over those without, by name.
        evidence: for it, over all joints.
    """

    joint: str
    turn: float
    mass: float
    sigma: float
    share: float
    moments: tuple[float, ...]
    alike: tuple[str, ...]
    tilted: bool
    drives: bool
    seen_at: str
    explained: float
    size: float
    with_it: Changes
    evidence: float
    beside: tuple[tuple[str, float], ...] = ()

    @property
    def label(self) -> str:
        """ID@JOINT of the effect that it is, of each where there are several."""
        effect = TURN if self.turn else EFFECT
        return " ".join(f"{effect}@{joint}" for joint in (self.joint, *(other for other, _ in self.beside)))


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
    told = [one for link in links for width in widths for one in told_of(rows, link, width, (1, len(link.sizes)))]
    told += turned_joints(rows, widths)
    if not told or max(one.evidence for one in told) <= 0.0:
        return None
    clearest = max(told, key=lambda one: one.evidence)
    least = clearest.evidence - nearly(max(one.seconds for one in clearest.some))
    # of those that are as good the simplest, and a mass is simpler than a mass at another place
    best = max((one for one in told if one.evidence >= least), key=lambda one: (-one.sizes, one.evidence))
    drives = _of_drives(rows, best)
    if drives > best.evidence or tilted > (best.evidence if best.sizes == 1 else least):
        return None
    as_good = [one for one in told if one.evidence >= least]
    return _sure(rows, best, as_good, tilted=tilted >= least, drives=drives >= least)


def tilted_base(rows: JointRows) -> float:
    """Evidence for weight in another direction, over all joints; zero where nothing tells of it.

    Args:
        rows: of the regression.
    """
    robot, here = rows.robot, EffectAt(catalogue()[TILT], "robot")
    if robot.has_effect(TILT, "robot") or cannot_be_added(robot, here):
        return 0.0
    tilt = EffectHypothesis(here, here.effect.parameters_at(robot, "robot"))
    told = [one for width in WIDTHS for one in told_of(rows, tilt, width, (len(tilt.sizes),))]
    return max((one.evidence for one in told), default=0.0)


def _of_drives(rows: JointRows, best: Told) -> float:
    """Evidence for drives that make less, or more, than they are asked for, where commands are torques."""
    found = 0.0
    for one in best.some:
        plain = one.rows[:, : -one.width]
        freed = fit(rows.robot, one.joint, plain, free_gain=True).left
        found += max(evidence(one.plain, freed, one.seconds, 1), 0.0)
    return found


def _carries_all(robot: Robot, joint: str) -> bool:
    """Whether nothing moves but behind a joint: another zero of it is a base that is turned about its axis."""
    parents = list(robot.tree.model.parents)
    return parents[robot.tree.model.getJointId(joint)] == 0 and parents[1:].count(0) == 1


def _sure(rows: JointRows, best: Told, as_good: Sequence[Told], *, tilted: bool, drives: bool) -> WrongLink | None:
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
    others = [solved(rows, best.here, [one.without(name) for one in best.some])[0] for name in names]
    sigmas = np.sqrt((len(names) - 1.0) * np.var(others, axis=0))
    body = robot.tree.model.inertias[robot.tree.model.getJointId(best.here.here.owner)]
    turned = best.here.here.effect.id == TURN
    mass, turn = (0.0, float(best.found[0])) if turned else (float(best.found[0]), 0.0)
    possible = body.mass + mass > -SURE * sigmas[0]
    clear = np.abs(best.found) / np.maximum(sigmas, 1e-300)
    # of several zeros that are named each has to be sure; of a mass and its place one is enough
    if not possible or (np.min(clear) if turned else np.max(clear)) < SURE:
        return None
    with_it: Changes = {}
    for one in best.some:
        plain = fit(robot, one.joint, one.rows[:, : -one.width])
        found = fit(robot, one.joint, with_sizes(one, best.found))
        with_it |= changes_between(robot, robot.joints[one.joint], plain, found)
    if size < LARGE and max((abs(factor - 1.0) for factor in with_it.values()), default=0.0) < MOVED:
        return None
    kind = [one for one in as_good if one.here.here.effect == best.here.here.effect]
    alike = dict.fromkeys(one.here.here.owner for one in kind if one.sizes <= best.sizes)
    owners = [one.here.owner for one in best.together]
    alike = {joint: None for joint in alike if joint not in owners}
    return WrongLink(
        joint=best.here.here.owner,
        turn=turn,
        mass=mass,
        sigma=float(sigmas[0]),
        share=mass / body.mass if body.mass > 0.0 else np.inf,
        moments=() if turned else tuple(best.found[1:].tolist()),
        alike=tuple(alike),
        tilted=tilted or (turned and _carries_all(robot, best.here.here.owner)),
        drives=drives,
        seen_at=robot.joints[seen.joint],
        explained=explained,
        size=size,
        with_it=with_it,
        evidence=best.evidence,
        beside=tuple(zip(owners[1:], best.found[1:].tolist(), strict=True)) if turned else (),
    )
