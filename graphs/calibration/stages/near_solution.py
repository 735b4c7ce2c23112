# SPDX-License-Identifier: BSD-3-Clause
"""Where a calibration begins that is near its solution: values, and states where those of a model near it are known.

States from measurements are thousands of sigmas from any that the law holds, and every step from there looks at all
samples. Those of a neighbouring model are a step or two away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class NearSolution:
    """A point near the solution.

    Attributes:
        calibrations: values with the biases of each recording.
        states: of each recording at its ticks, shape (m, d); from the measurements where empty.
    """

    calibrations: Sequence[Calibration]
    states: Sequence[Array] = ()

    def states_of(self, problems: Sequence[BagProblem]) -> Sequence[Array]:
        """The states, if they are those of some problems; none if ticks or layout are others."""
        pairs = list(zip(problems, self.states, strict=False))
        fits = all(x.shape == (len(p.timeline.ticks), p.robot.layout.size) for p, x in pairs)
        return self.states if fits and len(pairs) == len(problems) else ()
