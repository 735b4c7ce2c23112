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
from jointscope.graphs.rests.independent_states import reduced
from jointscope.graphs.rests.rest_set import EDGE
from jointscope.robots.errors import SolveError
from jointscope.robots.files.effect_editing import add_effect
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
        costs: of each rest when it was left out, shape (m,); None where others were better already.
    """

    score: RestScore
    fit: RestFit
    sigmas: dict[str, float]
    costs: Array | None = None

    @property
    def label(self) -> str:
        """ID@OWNER."""
        return self.score.label

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
    starters = [each for each in (_fitted(base, score) for score in _starters(scores, count)) if each is not None]
    starters.sort(key=lambda each: each.fit.cost + each.score.dof)
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
        if len(found) == STARTERS or not significant(score, count):
            break
        if sum(scores.alike(score, other) > ALIKE for other in found) < OF_A_KIND:
            found.append(score)
    return found


def _fitted(base: RestFit, score: RestScore) -> Tried | None:
    """An effect fitted to all rests; None where the fit ran away, which is where it explains less than nothing."""
    robot = with_score(base.robot, score)
    start = Calibration.of(robot).only(base.calibration.blocks)
    for edges in STAGES:
        try:
            fit = fit_rests(base.rests.of_robot(robot), base.x, start, edges)
        except SolveError:
            continue
        if fit.cost < base.cost:
            return Tried(score, fit, _sigmas(fit, score))
    return None


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


def _sigmas(fit: RestFit, score: RestScore) -> dict[str, float]:
    H, _ = reduced(fit.rests.linearize(fit.x, fit.calibration))
    own = fit.calibration.columns[DYNAMICS]
    parameters = fit.rests.robot.parameters
    weight = [1.0 / parameters[name].coordinate_sigma ** 2 for name in fit.calibration.names]
    covariance = np.linalg.inv(H[own, own] + np.diag(weight))
    sigmas = dict(
        zip(fit.calibration.names, np.sqrt(np.diag(covariance)) * fit.calibration.value_by_coordinate, strict=True)
    )
    here = score.score.hypothesis.here
    return {size.name: float(sigmas[here.parameter(size.name)]) for size in score.score.hypothesis.sizes}


def _left_out(fit: RestFit, folds: Sequence[Mask]) -> Array:
    """Cost of each rest, fitted to the groups that it is not in, shape (m,)."""
    found = np.zeros(len(fit.x))
    for fold in folds:
        found[fold] = fit.without(fold).costs_of(fit.rests.only(fold), fit.x[fold])
    return found
