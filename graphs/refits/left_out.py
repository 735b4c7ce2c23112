# SPDX-License-Identifier: BSD-3-Clause
"""What pieces that a refit leaves out say of its values, before its noise is known: whether the rest of it is worth it.

Half of a refit goes into its noise, and as much into predictions that judge it. Values that explain what the model
lacks let the states of other pieces follow their readings, too; those that only follow what they are fitted to do not.
With values held and the noise of the base model, the lowest cost of a piece is -log p of its readings up to what both
models share. Where that is larger by a good part of the whole, nothing that a noise can be makes up for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.base_model import BaseModel, Span
from jointscope.graphs.problem.known_values import with_known_values
from jointscope.graphs.refits.loop_validation import judged_by_loop
from jointscope.graphs.refits.refit import ENOUGH, BegunRefit, pieces_of
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.robots.errors import JointscopeError
from jointscope.robots.model.robot import Robot

FAR = 1.3  # times the cost with the base model from which no noise helps; true effects lower it, be they fitted badly
ITERATIONS = 15  # states follow other values


@dataclass(frozen=True)
class Missed:
    """A refit that was given up.

    Attributes:
        times: the cost of what it leaves out, over that of the model without its effect.
        converged: whether its values had come to rest.
    """

    times: float
    converged: bool


@dataclass(frozen=True)
class LeftOut:
    """Pieces that no refit is fitted to.

    Attributes:
        base: the base model.
        spans: the pieces.
        cost: of their readings with the base model, fitted to the same pieces as refits.
    """

    base: BaseModel
    spans: tuple[Span, ...]
    cost: float

    @staticmethod
    def of(base: BaseModel, spans: tuple[Sequence[Span], Sequence[Span]]) -> LeftOut | None:
        """Pieces that are left out of a fit of others, with what the base model makes of them, fitted to those, too.

        What a fit to short pieces loses elsewhere is no fault of an effect.

        Args:
            base: the base model.
            spans: pieces on which refits are fitted, and those that they leave out.

        Returns:
            None where refits are fitted to everything.
        """
        if judged_by_loop(base.robot, base.recordings):
            return None
        known = LeftOut(base, tuple(spans[1]), 1.0)
        try:
            cost = known.times(BegunRefit.of(base, spans[0], None))
        except (JointscopeError, np.linalg.LinAlgError):
            return None
        return replace(known, cost=cost) if cost > 0.0 else None

    def times(self, begun: BegunRefit) -> float:
        """The cost with the values of a refit, over that without its effect; 0 where its states do not come to rest."""
        cost = self._cost_with(replace(begun.robot, noise=begun.noise), begun.solution.estimate.calibrations[0])
        return 0.0 if cost is None else cost / self.cost

    def asked(self, begun: BegunRefit) -> BegunRefit | Missed:
        """The refit, perhaps with more iterations, or that it misses these pieces.

        Values that have not come to rest may begin far off: they are given as many iterations again.
        """
        times = self.times(begun)
        if times >= FAR and not begun.solution.converged:
            begun = begun.further()
            times = self.times(begun)
        return begun if times < FAR else Missed(times, begun.solution.converged)

    def _cost_with(self, robot: Robot, values: Calibration) -> float | None:
        """The lowest cost with some values and the robot's noise; biases of the pieces are free."""
        problems, start = pieces_of(self.base, robot, self.spans)
        own = [calibration.with_points(values.common) for calibration in start.calibrations]
        try:
            pairs = [with_known_values(*pair) for pair in zip(problems, own, strict=True)]
            known = Estimate(start.states, tuple(calibration for _, calibration in pairs))
            hold = tuple(known.calibrations[0].common)
            found = solve(
                [problem for problem, _ in pairs], known, max_iterations=ITERATIONS, step_tolerance=ENOUGH, hold=hold
            )
        except (JointscopeError, np.linalg.LinAlgError):
            return None
        return found.cost if found.converged or found.flat else None
