# SPDX-License-Identifier: BSD-3-Clause
"""Effects that a robot with free links may lack: each must explain seconds that were not fitted, and hold elsewhere.

Every other second of the recordings is fitted and the seconds between judge. Errors are coloured, so what is believed
is what blocks of time agree about, not what white noise would allow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc

from jointscope.graphs.comparison.comparison_result import SENSOR_NOISE
from jointscope.graphs.discovery.diagnosis_result import Candidate, EffectEstimate
from jointscope.graphs.discovery.verdicts import MOST
from jointscope.graphs.transmission.candidates import Hypothesis, hypotheses, may_be_added
from jointscope.graphs.transmission.equation import ELASTICITY, RIPPLE, ripple, sizes_of
from jointscope.graphs.transmission.linear_equations import (
    LinearEquations,
    fit_seconds,
    judged_seconds,
    one_block,
    without_block,
)
from jointscope.graphs.transmission.links_model import LinksModel
from jointscope.graphs.transmission.look_alikes import lateness_sentence, look_alikes
from jointscope.graphs.transmission.strongest_order import strongest_order
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

MATTERS = 0.05  # share of the squared error of the equations concerned that an effect must explain
SEARCHED = 0.1  # the same for a ripple whose order is the best of hundreds
SURE = 3.0  # [sigma] a size must be away from zero
QUARTERS = 4  # of the recordings, left out one by one
BY_CHANCE = 0.05  # corrected for the number of effects, up to which one that is refused is possible all the same
ORDER = ("missing", "possible", "absent", "untestable")


@dataclass(frozen=True)
class Additions:
    """Fits of a model with one more effect each.

    Attributes:
        base: the model.
        equations: its linear equations, with the columns of all effects.
        tried: effects that may be added.
        others: effects that need another one first, but would look alike.
        before: error of each equation in the seconds between, without a further effect [sigma].
    """

    base: LinksModel
    equations: LinearEquations
    tried: tuple[Hypothesis, ...]
    others: tuple[Hypothesis, ...]
    before: Mapping[str, float]

    @staticmethod
    def of(base: LinksModel) -> Additions:
        """Looks up what may be added, a ripple both once per turn and at the order that stands out."""
        rows, found = base.rows(), hypotheses(base.robot)
        for h in [h for h in found if h.effect == RIPPLE]:
            order = strongest_order(rows, h.owner)
            if order is not None:
                found.append(replace(h, order=order))
                for i, r in enumerate(rows):
                    if r.equation.name == f"{h.owner}.gear":
                        rows[i] = replace(r, equation=ripple(r.equation, h.owner, order, found[-1].mark))
        own = base.columns()
        names = dict.fromkeys([*own, *(name for h in found for name in h.columns)])
        equations = LinearEquations.of(rows, tuple(names))
        before = equations.errors(own, equations.fitted(own, fit_seconds), judged_seconds)
        tried = tuple(h for h in found if may_be_added(h, base.robot))
        return Additions(base, equations, tried, tuple(h for h in found if h not in tried), before)

    def candidates(self) -> tuple[list[Candidate], dict[str, Robot]]:
        """All effects, once for each owner, the best first; and the robots with those that are missing."""
        judged = sorted((self._judged(h) for h in self.tried), key=lambda j: (ORDER.index(j[0].verdict), -j[1]))
        found: dict[str, tuple[Candidate, Robot]] = {}
        for candidate, _, robot in judged:
            found.setdefault(candidate.label, (candidate, robot))
        refits = {label: robot for label, (c, robot) in found.items() if c.verdict == "missing"}
        return [candidate for candidate, _ in found.values()], refits

    def _judged(self, h: Hypothesis) -> tuple[Candidate, float, Robot]:
        """A candidate, what it takes from the squared error, and the robot with it."""
        equations, own = self.equations, self.base.columns()
        names, k, count = (*own, *h.columns), len(own), len(h.sizes)
        after = equations.errors(names, equations.fitted(names, fit_seconds), judged_seconds)
        concerned = {place.name for place in equations.places if equations.excites(place, h.columns[:count])}
        old, new = (sum(errors[name] ** 2 for name in concerned) for errors in (self.before, after))
        share = (old - new) / old if old > 0.0 else 0.0
        sizes, V = equations.fitted(names)[k:], equations.spread(names)[k:, k:]
        p_value = _by_chance(sizes[:count], V[:count, :count], h.one_sided) * len(self.tried)
        why = self._why_not(h, names, share, concerned, sizes[:count], np.sqrt(np.diag(V)[:count]))
        verdict = "missing" if not why else "possible" if share >= MATTERS and p_value < BY_CHANCE else "absent"
        if not concerned:
            verdict, why = "untestable", "nothing in these recordings would show it"
        per_size = self._per_size(h)
        laws = [name.rsplit(".", 1)[1] for name in h.sizes]
        units = {p.name: p.unit for p in catalogue()[h.effect].parameters}
        values = dict(zip(laws, (sizes * per_size).tolist(), strict=False))
        sigmas = zip(laws, (np.sqrt(np.diag(V)) * per_size).tolist(), strict=False)
        robot, alike = self.base.robot, tuple[str, ...]()
        if verdict in ORDER[:2]:
            alike = look_alikes(equations, own, h, (*self.tried, *self.others))
        if verdict == "missing":
            robot = h.added_to(robot, values, float(sizes[-1] / sizes[0]))
            why = self._what(h, share)
        candidate = Candidate(
            effect=h.effect,
            owner=h.owner,
            score=float(equations.left(own) - equations.left(names)),
            dof=count,
            p_value=min(p_value, 1.0),
            parameters={law: EffectEstimate(values[law], sigma, units[law]) for law, sigma in sigmas},
            verdict=verdict,
            share=share,
            validation_error=total(after),
            look_alikes=alike,
            reasons=(why,),
        )
        return candidate, total(self.before) ** 2 - total(after) ** 2, robot

    def _why_not(
        self, h: Hypothesis, names: Sequence[str], share: float, concerned: set[str], sizes: Array, sigmas: Array
    ) -> str:
        """Why an effect is refused; empty if it is not."""
        if share < (SEARCHED if h.mark else MATTERS):
            return f"explains {100 * max(share, 0.0):.1f} % of what is left in the seconds that were not fitted"
        would = f"would explain {100 * share:.0f} %, but"
        if h.one_sided and np.any(sizes < 0.0):
            return f"{would} with a size of {sizes[0]:.3g}, and only sizes above zero exist"
        if not np.any(np.abs(sizes) > SURE * sigmas):
            return f"{would} with a size that blocks of the recording do not agree about"
        rarely = self._helps_rarely(names, concerned)
        return rarely or fails_elsewhere(self.equations, self.base.columns(), names, concerned)

    def _helps_rarely(self, names: Sequence[str], concerned: set[str]) -> str:
        """Why an effect that helps in few seconds is refused; empty if it helps in most.

        Seconds that leave no more than the noise of the sensors, as those at rest do, cannot tell and are not asked.
        """
        means = []
        for columns in (self.base.columns(), names):
            found = self.equations.squares(columns, self.equations.fitted(columns, fit_seconds), judged_seconds)
            means.append(np.concatenate([squares / counts for name, squares, counts in found if name in concerned]))
        asked = means[0] > SENSOR_NOISE
        if not asked.any():
            return "leaves nothing to explain: what is left where it was not fitted is the noise of the sensors"
        helped = float(np.mean(means[1][asked] < means[0][asked]))
        often = f"{100 * helped:.0f} % only of the seconds that were not fitted"
        return "" if helped >= MOST else f"would explain more on the whole, but helps in {often}"

    def _what(self, h: Hypothesis, share: float) -> str:
        """What speaks for an effect."""
        text = f"explains {100 * share:.0f} % of what is left in the seconds that were not fitted"
        if h.mark:
            text += f", with {h.order:.4g} periods per turn of the joint"
        encoder = self.base.robot.link_encoder
        if encoder is not None and h.owner == encoder.name:
            return f"{text}; {lateness_sentence(self.equations, self.base.columns(), h)}"
        return text

    def _per_size(self, h: Hypothesis) -> float:
        """Value of its parameters per size: torques are seen through the compliance."""
        spring = f"{h.owner}.{ELASTICITY}"
        known = {name: p.value for name, p in self.base.robot.parameters.items() if name == spring}
        return 1.0 / (sizes_of({h.sizes[0]: 1.0, **known})[h.sizes[0]][1] or 1.0)


def fails_elsewhere(
    equations: LinearEquations, before: Sequence[str], after: Sequence[str], concerned: set[str]
) -> str:
    """Why an effect that helps between the seconds that were fitted is refused; empty if it helps further away, too.

    Seconds next to each other hold the same motion; what only repeats there fails on a quarter that was left out whole.
    """
    sums = [0.0, 0.0]
    for i, names in enumerate((before, after)):
        for k in range(QUARTERS):
            sizes = equations.fitted(names, without_block(k, QUARTERS))
            found = equations.squares(names, sizes, one_block(k, QUARTERS))
            sums[i] += sum(float(squares.sum()) for name, squares, _ in found if name in concerned)
    if sums[1] < sums[0]:
        return ""
    return "would help between the seconds that were fitted, but not on quarters of the recordings left out whole"


def total(by_equation: Mapping[str, float]) -> float:
    """Root mean square over the equations."""
    return float(np.sqrt(np.mean(np.square(list(by_equation.values())))))


def _by_chance(sizes: Array, V: Array, one_sided: bool) -> float:
    """How often sizes as large come of chance."""
    both = float(gammaincc(0.5 * len(sizes), 0.5 * float(sizes @ np.linalg.pinv(V) @ sizes)))
    return both if not one_sided else 0.5 * both if sizes[0] > 0.0 else 1.0 - 0.5 * both
