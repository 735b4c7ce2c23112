# SPDX-License-Identifier: BSD-3-Clause
"""What each rigid joint lacks, by regression: the effect of the catalogue that explains the torque that is left.

Each joint is asked alone, so what others lack does not blur the answer; a score test after a calibration looks through
process noise that has taken most of what is missing. An effect is named where it explains most of what the plain
regression leaves, and where no cause of another kind (a delay, a mass, gravity from elsewhere) explains as much.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis, hypotheses_of
from jointscope.graphs.scoring.hypothesis_score import best_shapes
from jointscope.graphs.scoring.regression.evidence import AS_GOOD, evidence, nearly
from jointscope.graphs.scoring.regression.joint_regression import Fit, JointRows, changes_between, fit
from jointscope.graphs.scoring.regression.ripples import EFFECT as RIPPLE
from jointscope.graphs.scoring.regression.ripples import ORDER, Ripple, ripple_of
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.graphs.starts.drive_regression import MOST_NOISE
from jointscope.graphs.starts.windowed_sums import WIDTHS
from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.effect_kinds.joint_torque import JointTorque
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

MOST_SHAPES = 10  # of an effect: with more, some fit what they are not
DELAY = "command_delay"
WEIGHTS = ("gravity_imbalance",)  # torques of a joint that are a wrong weight as well: masses are asked for elsewhere
CONSTANTS = ("torque_constant_error",)  # what the regression has anyhow
LEFT = 0.5  # of the mean square, that an effect may leave of what the plain regression leaves
SHARED = 2.5  # windows that overlap so much that they count as one
LARGE = 0.005  # of the drive's rms torque, from which what an effect explains matters to anybody
BY_CHANCE = 1e-4  # probability, over all causes that are confirmed together, from which one may be chance
SURE = 30.0  # ratio of variances, explained over left, from which it is no chance


@dataclass(frozen=True)
class RegressedCause:
    """An effect that one joint lacks.

    Attributes:
        effect: its id in the catalogue.
        joint: that lacks it.
        alike: ids of effects that explain as much with as many sizes.
        explained: share of the mean square that the plain regression leaves.
        size: rms of what it explains, over that of the drive.
        with_it: parameters of the joint with the effect over those without, by name.
        evidence: for it, at its joint.
        shapes: the order of the ripple that it is, or looks like.
    """

    effect: str
    joint: str
    alike: tuple[str, ...]
    explained: float
    size: float
    with_it: dict[str, float]
    evidence: float
    shapes: Mapping[str, float] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """ID@JOINT."""
        return f"{self.effect}@{self.joint}"


class _Told(NamedTuple):
    """Regressions in windows of one width.

    Attributes:
        plain: without any effect.
        fits: with one each.
        driving: mean square of the commands.
        windows: how many.
        seconds: that they tell of.
    """

    plain: Fit
    fits: list[Fit]
    driving: float
    windows: int
    seconds: float


def regressed_causes(rows: JointRows) -> tuple[RegressedCause, ...]:
    """What the joints lack, in the order of the joints; nothing where regression tells nothing.

    Args:
        rows: of the regression, of the calibrated robot and the recordings of the calibration.
    """
    asked = _hypotheses(rows.robot)
    found = [_of_joint(rows, joint, asked) for joint in range(rows.robot.n)]
    return _agreed([cause for cause in found if cause is not None])


def confirmed(causes: Sequence[RegressedCause], test: ScoreTest) -> tuple[RegressedCause, ...]:
    """Those whose effect a calibration asks for, too: what its residuals do not need is a defect of the regression.

    Args:
        causes: what regression says.
        test: of the whole recordings, linearised at their solution with the noise used.
    """
    effects = asked_for({cause.label: cause.shapes for cause in causes}, test)
    return tuple(cause for cause in causes if cause.effect in effects)


def late_commands(rows: JointRows) -> float:
    """Evidence that commands act later, or earlier, than stamped, over all joints; zero where nothing tells of it.

    Args:
        rows: of the regression.
    """
    delays, worth = [h for h in hypotheses_of(rows.robot) if h.here.effect.id == DELAY], 0.0
    for joint in range(rows.robot.n):
        tried = [_under(rows, joint, width, delays) for width in WIDTHS]
        worth += max((_of_first(one) for one in tried if one is not None), default=0.0)
    return worth


def _of_first(told: _Told) -> float:
    return max(evidence(told.plain.left, min(fit.left for fit in told.fits), told.seconds, 1), 0.0)


def asked_for(labels: Mapping[str, Mapping[str, float]], test: ScoreTest) -> set[str]:
    """Which effects a calibration asks for, by id, if only at one joint: what one's noise hides another's shows.

    Args:
        labels: ID@OWNER of each that may be, with its shapes where these are known.
        test: of the whole recordings, linearised at their solution with the noise used.
    """
    asked = [h for h in hypotheses_of(test.robot) if h.label in labels]
    asked = [h for h in asked if not h.shapes or labels[h.label].items() <= h.shapes.items()]
    best = best_shapes(test.each(asked)) if asked else {}
    sure = [s.hypothesis for s in best.values() if len(asked) * chdtrc(s.dof, s.plausible[0]) < BY_CHANCE]
    return {hypothesis.here.effect.id for hypothesis in sure}


def _hypotheses(robot: Robot) -> list[EffectHypothesis]:
    asked = [h for h in hypotheses_of(robot) if h.here.effect.id not in CONSTANTS]
    shapes = Counter(h.label for h in asked)
    return [h for h in asked if shapes[h.label] <= MOST_SHAPES]


def _of_joint(rows: JointRows, joint: int, asked: Sequence[EffectHypothesis]) -> RegressedCause | None:
    """The effect that a joint lacks; None where none stands out, or where it is a cause of another kind."""
    tried = [_under(rows, joint, width, asked) for width in WIDTHS]
    told = [one for one in tried if one is not None]
    if not told:
        return None
    # narrow windows pass noise, wide ones lose motion
    told_of = min(told, key=lambda one: min(fit.left for fit in one.fits) / one.plain.left)
    plain, fits, driving = told_of.plain, told_of.fits, told_of.driving
    least = min(fit.left for fit in fits)
    ripple, worth = ripple_of(rows, joint), evidence(plain.left, least, told_of.seconds, 1)
    if ripple is not None and ripple.periods >= 1.0 and ripple.evidence > worth + nearly(told_of.seconds):
        return _as_cause(rows, joint, ripple)
    # what is as good as the best, simplest first, of those causes that belong to the joint first
    good = sorted((f for f in fits if f.left <= AS_GOOD * least), key=lambda f: (f.sizes, not _is_own(f), f.left))
    best = good[0]
    explained = 1.0 - best.left / plain.left
    size = float(np.sqrt(explained * plain.left / driving))
    ratio = explained * told_of.windows / SHARED / max((1.0 - explained) * best.sizes, 1e-9)
    if best.left > LEFT * plain.left or size < LARGE or ratio < SURE or not _is_own(best):
        return None
    alike = dict.fromkeys(_id(f) for f in good[1:] if f.sizes == best.sizes)
    alike.pop(_id(best), None)
    changes = changes_between(rows.robot, rows.robot.joints[joint], plain, best)
    told_by, shapes, name = evidence(plain.left, best.left, told_of.seconds, best.sizes), {}, rows.robot.joints[joint]
    if ripple is not None and ripple.evidence > told_by + nearly(told_of.seconds) and not _shapes(best):
        alike, shapes = {RIPPLE: None, **alike}, {ORDER: ripple.order}
    return RegressedCause(_id(best), name, tuple(alike), explained, size, changes, told_by, shapes)


def _as_cause(rows: JointRows, joint: int, ripple: Ripple) -> RegressedCause | None:
    explained = 1.0 - ripple.best.left / ripple.plain.left
    size = float(np.sqrt(explained * ripple.plain.left / ripple.driving))
    name = rows.robot.joints[joint]
    changes, shapes = changes_between(rows.robot, name, ripple.plain, ripple.best), {ORDER: ripple.order}
    cause = RegressedCause(RIPPLE, name, (), explained, size, changes, ripple.evidence, shapes)
    return cause if size >= LARGE and ripple.evidence > -np.log(BY_CHANCE) else None


def _under(rows: JointRows, joint: int, width: float, asked: Sequence[EffectHypothesis]) -> _Told | None:
    """The regressions in windows of one width [s]; None where there are too few windows."""
    here = rows.of(joint, width)
    if here is None:
        return None
    plain, driving = fit(rows.robot, joint, here), float(np.mean(here[:, 0] ** 2))
    with_columns = [(hypothesis, rows.of(joint, width, hypothesis)) for hypothesis in asked]
    fits = [fit(rows.robot, joint, more, h) for h, more in with_columns if more is not None]
    least = MOST_NOISE * rows.noise(joint, width, plain)
    fits = [one for one in fits if _is_possible(one) and (one.left > least or not _is_of_command(one))]
    return (
        _Told(plain, fits, driving, len(here), rows.seconds(width, len(here)))
        if fits and plain.left > 0.0 < driving
        else None
    )


def _id(fit: Fit) -> str:
    return "" if fit.hypothesis is None else fit.hypothesis.here.effect.id


def _shapes(fit: Fit) -> Mapping[str, float]:
    return {} if fit.hypothesis is None else fit.hypothesis.shapes


def _is_possible(fit: Fit) -> bool:
    """Whether sizes of which only one sign is physical have it."""
    assert fit.hypothesis is not None
    scale = 1.0 if isinstance(fit.hypothesis.here.effect, CommandEffect) else fit.gain
    found = zip(fit.hypothesis.sizes, (scale * fit.more[len(fit.more) - fit.sizes :]).tolist(), strict=True)
    return all(value > 0.0 for size, value in found if size.sign == "+")


def _is_of_command(fit: Fit) -> bool:
    """Whether its column is made of the command that is regressed on it, and may hold its noise as well."""
    return fit.hypothesis is not None and isinstance(fit.hypothesis.here.effect, CommandEffect)


def _is_own(fit: Fit) -> bool:
    """Whether it is a cause of this joint that is asked for nowhere else: no weight, no delay."""
    assert fit.hypothesis is not None
    effect = fit.hypothesis.here.effect
    if isinstance(effect, CommandEffect):
        return all(size.unit != "s" for size in effect.parameters)
    return isinstance(effect, JointTorque) and effect.id not in WEIGHTS


def _agreed(found: list[RegressedCause]) -> tuple[RegressedCause, ...]:
    """Of effects that are alike, those that most joints lack."""
    votes = Counter(effect for cause in found for effect in (cause.effect, *cause.alike))
    places = Counter(effect for cause in found for effect in cause.alike)  # how often it is not the first
    agreed = []
    for cause in found:
        among = (cause.effect, *cause.alike)
        first = max(among, key=lambda effect: (votes[effect], -places[effect], effect))
        others = tuple(effect for effect in among if effect != first)
        agreed.append(replace(cause, effect=first, alike=others))
    return tuple(agreed)
