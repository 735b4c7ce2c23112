# SPDX-License-Identifier: BSD-3-Clause
"""What a solve must have reached before its values are used, and what is said where it has not."""

from __future__ import annotations

from jointscope.graphs.solving.batch_solver import Solution
from jointscope.robots.errors import SolveError
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.robots.model.robot import Robot

VANISHED = 0.1  # of its prior, a size that may be on its way to nothing


def must_converge(solution: Solution, robot: Robot, enough: float) -> None:
    """Raises unless the solver converged, gained nothing more, or made a last step shorter than `enough` sigmas."""
    if solution.converged or solution.flat:
        return
    last = solution.iterations[-1]
    if last.step_in_sigmas >= enough:
        gone = _vanishing(robot, solution)
        raise SolveError(
            f"no convergence after {len(solution.iterations)} iterations: the last step was still "
            f"{last.step_in_sigmas:.2g} sigma and the cost fell from {last.cost_before:.6g} to {last.cost_after:.6g}; "
            + gone
            + "start values may be far off, or the model may contradict the recording"
        )


def _vanishing(robot: Robot, solution: Solution) -> str:
    """A clause about effects whose sizes go to nothing, a long way for logarithms; empty if there are none."""
    calibration = solution.estimate.calibrations[0]
    values = calibration.by_name
    gone = [
        here.label
        for here in robot.effects
        if any(
            name in values
            and robot.parameters[name].positive
            and values[name] < VANISHED * robot.parameters[name].prior
            for name in (here.parameter(p.name) for p in here.effect.parameters_at(robot, here.owner))
        )
    ]
    if not gone:
        return ""
    return (
        f"sizes of {', '.join(gone)} are below a tenth of their start, so the recording may show no such effect: "
        f"`jointscope remove {robot_argument(robot)} {' '.join(gone)} -o {edited_argument(robot, 'without')}`; else "
    )
