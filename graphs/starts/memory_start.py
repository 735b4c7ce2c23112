# SPDX-License-Identifier: BSD-3-Clause
"""States of effects with a memory must follow the motion before the parameters may move.

Nothing measures a memory, so its states start empty, and the torque they stand for is missing from the first reversal
on. A solver that may bend the parameters to make up for that runs off to sizes a hundred times too large.
"""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.factors.calibration import DYNAMICS
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.estimate import Estimate

ITERATIONS = 12  # four do on a robot whose other parameters are right


def with_filled_memories(problems: Sequence[BagProblem], start: Estimate, hold: Sequence[str] = ()) -> Estimate:
    """The estimate with states that fit its parameters; as it is where no effect has a memory.

    Args:
        problems: factors of each recording.
        start: estimate with empty memories.
        hold: further blocks that stay.

    Raises:
        SolveError: no states fit the parameters.
    """
    if not problems[0].robot.memories:
        return start
    return solve(problems, start, max_iterations=ITERATIONS, hold=(DYNAMICS, *hold)).estimate
