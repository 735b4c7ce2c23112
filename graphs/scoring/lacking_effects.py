# SPDX-License-Identifier: BSD-3-Clause
"""Which effects of the catalogue would change the values: a score test after every calibration.

A model that lacks an effect has wrong values with small sigmas, and process noise takes what is left, so that residuals
need not tell. One linear step with the effect does: how large it would be, whether that may be chance, and which values
it would change. Nothing is estimated anew: `diagnose` and `discover` do that, with predictions of other moments.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis, hypotheses_of
from jointscope.graphs.scoring.hypothesis_score import HypothesisStep, best_shapes
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.graphs.starts.drive_regression import Value
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

BY_CHANCE = 1e-2  # probability, over all effects that were asked for together, from which one may be chance
MOST = 20  # effects whose scatter over blocks is looked at
FEW = 0.1  # share of absent effects that windows leave to all samples
AS_SURE = 100.0  # times the probability of the surest effect of an owner, up to which another explains as much
SURE = 2.0  # [sigma of a value] that an effect must move it, and ...
MOVED = 0.01  # ... the share of the value: what is called right is right within a percent
MOST_SHAPES = 10  # beyond them, as for ripple of unknown order, one looks at a spectrum first; it moves values little
ROBOT = "robot"
SLOW_FORMS = ("integration", "bearing")  # changes of the whole model, of which one step tells little


@dataclass(frozen=True)
class LackingEffect:
    """What one step with an effect says.

    Attributes:
        effect: its id in the catalogue.
        owner: joint, link, sensor or robot.
        p_value: that it is chance, over the blocks of the recording and all effects that were asked for.
        worth: score less what its sizes cost.
        with_it: each parameter with the effect beside it, in the parameter's unit.
        tried: whether the values were found with the effect in the model, not by one linear step.
        uncertain: standard deviation of what the effect changes of each, where one linear step tells it.
    """

    effect: str
    owner: str
    p_value: float
    worth: float
    with_it: dict[str, float]
    tried: bool = False
    uncertain: dict[str, float] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """ID@OWNER."""
        return f"{self.effect}@{self.owner}"

    def moved(self, found: Mapping[str, Value], sigmas: float = SURE) -> dict[str, float]:
        """Relative changes of the values that the effect would change by much, by name; none where it may be chance.

        Args:
            found: calibrated values with their sigmas, by name.
            sigmas: of a value, that a change must be larger than.
        """
        if self.p_value > BY_CHANCE:
            return {}
        told = {n: self.with_it[n] - v.value for n, v in found.items() if n in self.with_it and v.value}
        told = {n: d for n, d in told.items() if abs(d) > SURE * self.uncertain.get(n, 0.0)}
        told = {n: d for n, d in told.items() if not n.endswith(".delay") and abs(d) > sigmas * found[n].sigma}
        return {n: d / abs(found[n].value) for n, d in told.items() if abs(d) > MOVED * abs(found[n].value)}


@dataclass(frozen=True)
class Suspects:
    """What is asked for after a calibration.

    Attributes:
        hypotheses: not ruled out yet.
        tried: how many there were, with those that a part of the samples ruled out.
    """

    hypotheses: Sequence[EffectHypothesis]
    tried: int

    @staticmethod
    def of(robot: Robot) -> Suspects:
        """All that needs no model of its own, and no search among many shapes."""
        if robot.choices.link_dynamics != "model":
            return Suspects((), 0)
        asked = hypotheses_of(robot)
        asked = [h for h in asked if not (isinstance(h.here.effect, Structure) and h.here.effect.form in SLOW_FORMS)]
        shapes = Counter(h.label for h in asked)
        # curves with knots cost many columns, and their look-alikes of fewer terms stand for them
        knots = {h.label for h in asked if any(p.of_range for p in h.here.effect.parameters)}
        asked = [h for h in asked if shapes[h.label] <= MOST_SHAPES and h.label not in knots]
        return Suspects(asked, len(asked))

    def left_by(self, windows: ScoreTest) -> Suspects:
        """Those whose score on a part of the samples is more than what nine of ten absent effects have there."""
        scores = windows.each(self.hypotheses)
        return Suspects([s.hypothesis for s in scores if chdtrc(s.dof, s.score) < FEW], self.tried)


def lacking_effects(test: ScoreTest, suspects: Suspects) -> tuple[LackingEffect, ...]:
    """Effects that a solved calibration asks for, surest first; few, or none.

    Args:
        test: of the whole recordings, linearised at their solution with the noise used.
        suspects: what is asked for.
    """
    if not suspects.hypotheses:
        return ()
    best, tried = best_shapes(test.each(suspects.hypotheses)).values(), suspects.tried
    seen = [s for s in best if s.plausible[0] == s.score and tried * chdtrc(s.dof, s.score) < BY_CHANCE]
    seen = sorted(seen, key=lambda score: -score.score)[:MOST]
    steps = zip(test.steps([score.hypothesis for score in seen]), seen, strict=True)
    return _leaders([_lacking(test, step, tried, s.worth(test.seconds)) for step, s in steps if _is_possible(step)])


def _leaders(found: Sequence[LackingEffect]) -> tuple[LackingEffect, ...]:
    """The surest of each owner with those that explain as much, simplest first; what another explains is no cause."""
    surest: dict[str, float] = {}
    for effect in found:
        surest[effect.owner] = min(surest.get(effect.owner, 1.0), effect.p_value)
    of_all = min(surest.values(), default=1.0)
    groups = {owner: of_all if owner == ROBOT else p for owner, p in surest.items()}
    kept = [effect for effect in found if effect.p_value <= AS_SURE * groups[effect.owner]]
    return tuple(sorted(kept, key=lambda effect: (groups[effect.owner], -effect.worth)))


def _is_possible(step: HypothesisStep) -> bool:
    """Whether the step ends at a size that may be; beyond, one linear step tells nothing."""
    usual = np.array([size.prior_sigma for size in step.hypothesis.sizes])
    return bool(np.all(np.abs(step.sizes) <= usual) and np.isfinite(step.p_value))


def _lacking(test: ScoreTest, step: HypothesisStep, tried: int, worth: float) -> LackingEffect:
    here = step.hypothesis.here
    p_value, values, uncertain = min(tried * step.p_value, 1.0), test.values_with(step), test.change_sigmas(step)
    if isinstance(here.effect, InertiaEffect):  # a link and its rotor share their inertia, and only the sum is told
        values = {name: value for name, value in values.items() if not name.endswith(".inertia")}
    return LackingEffect(here.effect.id, here.owner, p_value, worth, values, uncertain=uncertain)
