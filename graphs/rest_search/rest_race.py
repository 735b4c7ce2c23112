# SPDX-License-Identifier: BSD-3-Clause
"""Effects that lead by their scores, fitted for real, and what the best of them are worth on rests left out.

All of them are fitted to all rests; a step to a spring's curve or a coupling is no small one, so the edges of friction
bands are blunt at first. Those that make the rests likeliest are fitted to all groups of rests but one in turn, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.rest_search.rest_fits import Mask, RestFit, fit_rests
from jointscope.graphs.rest_search.rest_scores import RestScore, RestScores
from jointscope.graphs.rest_sets.independent_states import reduced
from jointscope.graphs.rest_sets.rest_set import EDGE
from jointscope.robots.effect_kinds.joint_torque import JointTorque
from jointscope.robots.errors import SolveError
from jointscope.robots.files.effect_editing import add_effect, remove_effect
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
CHANCE = 0.01  # of any false effect among all that are looked at
ALIKE = 0.95  # correlation of what two effects explain
STARTERS, FINALISTS = 8, 4  # effects that are fitted for real, and those of them that are judged on what is left out
OF_A_KIND = 3  # starters that explain the same to first order
STAGES = ((EDGE,), (0.2, EDGE), (1.0, EDGE))  # of the friction: blur of the bands' edges; the next where one fails
SMALLEST_START = 0.05  # of the start value, where a size that is estimated as a logarithm begins at least


@dataclass(frozen=True)
class Tried:
    """An effect that was fitted.

    Attributes:
        score: of the linear step before.
        fit: of the model with it to all rests.
        sigmas: of its sizes, by the last part of their names.
        log_share: logarithm of the share of the priors' volume that the rests leave to all values.
        costs: of each rest when it was left out, shape (m,); None where others were better already.
    """

    score: RestScore
    fit: RestFit
    sigmas: dict[str, float]
    log_share: float
    costs: Array | None = None

    @property
    def label(self) -> str:
        """ID@OWNER."""
        return self.score.label

    @property
    def owner(self) -> str:
        """Where it acts."""
        return self.score.score.hypothesis.here.owner

    @property
    def evidence(self) -> float:
        """Logarithm of the marginal likelihood, but for what is the same with every effect (Laplace's method)."""
        return self.log_share - self.fit.cost

    @property
    def sizes(self) -> dict[str, float]:
        """What was found, by the last part of the name."""
        here, values = self.score.score.hypothesis.here, self.fit.values
        names = {size.name: here.parameter(size.name) for size in self.score.score.hypothesis.sizes}
        return {name: values[full] for name, full in names.items() if full in values}


@dataclass(frozen=True)
class Race:
    """Effects that were fitted, by label, and the costs of rests left out without any of them, shape (m,)."""

    tried: dict[str, Tried]
    without: Array


def race(base: RestFit, scores: RestScores, count: int, folds: Sequence[Mask]) -> Race:
    """Fits the leading effects.

    Args:
        base: the model without them.
        scores: of all effects.
        count: number of effects that were looked at.
        folds: groups of rests that are left out in turn.
    """
    starters = _all_fitted(base, _starters(scores, count))
    starters.sort(key=lambda each: each.fit.cost + each.score.dof)
    starters = _best_of_families(starters)
    if not starters:
        return Race({}, np.zeros(0))
    finalists = [replace(each, costs=_left_out(each.fit, folds)) for each in starters[:FINALISTS]]
    tried = {each.label: each for each in (*finalists, *starters[FINALISTS:])}
    return Race(tried, _left_out(base, folds))


def significant(score: RestScore, count: int) -> bool:
    """Whether a score is no chance among so many."""
    return not score.silent and score.p_value * count < CHANCE


def _starters(scores: RestScores, count: int) -> list[RestScore]:
    """The most significant effects, few of those that explain the same."""
    found: list[RestScore] = []
    for score in scores.scores:
        if len({of_family(other) for other in found}) == STARTERS or not significant(score, count):
            break
        # laws that differ in their detail alone are one
        alike = {of_family(other) for other in found if scores.alike(score, other) > ALIKE} - {of_family(score)}
        if len(alike) < OF_A_KIND or of_family(score) in {of_family(other) for other in found}:
            found.append(score)
    return found


def of_family(score: RestScore) -> str:
    """FAMILY@OWNER of an effect."""
    return score.score.hypothesis.here.family


def _best_of_families(starters: Sequence[Tried]) -> list[Tried]:
    """Of laws that differ in their detail alone the one with the largest marginal likelihood, in the same order."""
    best: dict[str, Tried] = {}
    for each in starters:
        name = of_family(each.score)
        if name not in best or each.evidence > best[name].evidence:
            best[name] = each
    return [each for each in starters if best[of_family(each.score)] is each]


def _all_fitted(base: RestFit, starters: Sequence[RestScore]) -> list[Tried]:
    """Effects fitted to all rests; of a family the finer ones begin at the coarser ones, too."""
    found, coarser = list[Tried](), dict[str, Tried]()
    for score in sorted(starters, key=lambda score: len(score.score.hypothesis.sizes)):
        each, coarse = _fitted(base, score), coarser.get(of_family(score))
        finer = None if coarse is None else _refined(coarse, score)
        each = finer if each is None or (finer is not None and finer.fit.cost < each.fit.cost) else each
        if each is not None:
            found.append(each)
            coarser[of_family(score)] = each
    return found


def _refined(coarse: Tried, score: RestScore) -> Tried | None:
    """An effect fitted from where a coarser member of its family ended; None where the fit ran away."""
    before, here = coarse.score.score.hypothesis.here, score.score.hypothesis.here
    assert isinstance(here.effect, JointTorque)
    values = here.effect.refined(before.effect, before.own(coarse.fit.robot.values))
    robot = add_effect(remove_effect(coarse.fit.robot, coarse.label), score.label, values)
    try:
        start = Calibration.of(robot).only(coarse.fit.calibration.blocks)
        fit = fit_rests(coarse.fit.rests.of_robot(robot), coarse.fit.x, start)
    except SolveError:
        return None
    return Tried(score, fit, *_sigmas_and_share(fit, score))


def _fitted(base: RestFit, score: RestScore) -> Tried | None:
    """An effect fitted to all rests; None where the fit ran away, which is where it explains less than nothing."""
    robot = with_score(base.robot, score)
    start = Calibration.of(robot).only(base.calibration.blocks)
    effect, best = score.score.hypothesis.here.effect, base.cost
    # the whole curve of a spring is a long way off, and sharp edges stop some fits on it: the best of all counts
    whole, found = isinstance(effect, JointTorque) and effect.curve == "whole", None
    for edges in STAGES:
        try:
            fit = fit_rests(base.rests.of_robot(robot), base.x, start, edges)
        except SolveError:
            continue
        if fit.cost < best:
            found, best = fit, fit.cost
            if not whole:
                break
    return None if found is None else Tried(score, found, *_sigmas_and_share(found, score))


def with_score(robot: Robot, score: RestScore) -> Robot:
    """The robot with an effect at the sizes that a linear step gives; those that do nothing at rest are held."""
    hypothesis, start = score.score.hypothesis, dict(score.score.hypothesis.shapes)
    for size, value in zip(hypothesis.sizes, score.score.estimate.tolist(), strict=True):
        value = float(np.clip(value, -size.prior_sigma, size.prior_sigma))
        start[size.name] = max(value, SMALLEST_START * size.start) if size.logarithmic else value
    known = {name: value for name, value in score.found.items() if name in robot.parameters}
    robot = add_effect(robot.with_values(known), score.label, start)
    held = {hypothesis.here.parameter(name) for name in score.held}
    parameters = {
        name: replace(p, fixed=True, value=p.prior if p.null is None else p.null) if name in held else p
        for name, p in robot.parameters.items()
    }
    return replace(robot, parameters=parameters)


def _sigmas_and_share(fit: RestFit, score: RestScore) -> tuple[dict[str, float], float]:
    """Sigmas of an effect's sizes, and `Tried.log_share`."""
    H, _ = reduced(fit.rests.linearize(fit.x, fit.calibration))
    own = fit.calibration.columns[DYNAMICS]
    parameters = fit.rests.robot.parameters
    weight = [1.0 / parameters[name].coordinate_sigma ** 2 for name in fit.calibration.names]
    information = H[own, own] + np.diag(weight)
    covariance = np.linalg.inv(information)
    share = 0.5 * float(np.sum(np.log(weight)) - np.linalg.slogdet(information)[1])
    sigmas = dict(
        zip(fit.calibration.names, np.sqrt(np.diag(covariance)) * fit.calibration.value_by_coordinate, strict=True)
    )
    here = score.score.hypothesis.here
    return {size.name: float(sigmas[here.parameter(size.name)]) for size in score.score.hypothesis.sizes}, share


def _left_out(fit: RestFit, folds: Sequence[Mask]) -> Array:
    """Cost of each rest, fitted to the groups that it is not in, shape (m,)."""
    found = np.zeros(len(fit.x))
    for fold in folds:
        found[fold] = fit.without(fold).costs_of(fit.rests.only(fold), fit.x[fold])
    return found
