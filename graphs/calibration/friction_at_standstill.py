# SPDX-License-Identifier: BSD-3-Clause
"""What a joint that stands says of its dry friction, where how sharply that turns over is looked for.

Motion comes first: as far as the encoder tells it from standing, it says how friction grows with speed. Then standstill
is asked, too. Where that ends at a law that turns over at speeds which the encoder sees, standstill says the rest.
Where it does not, the joint sticks: its friction is a sign, whose sharpness would grow without an end, and it is held
as sharp as the encoder tells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.calibration_summary import Solved
from jointscope.graphs.calibration.whole_stage import FEW_ITERATIONS, WholeStage, anchored
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.standstill import SATURATED, asked_joints, holding_sharpness, slowest_seen
from jointscope.graphs.solving.estimate import Estimate
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import SHARPNESS, Robot
from jointscope.robots.recordings.recording import Notice

SEEN = 1.0  # of a law tanh(x), the x of the slowest speed that the encoder tells from none


def asked_at_standstill(stage: WholeStage, solved: Solved) -> Solved:
    """The solution in which standstill says its part about the sharpness of friction, or that a joint sticks.

    Args:
        stage: solves.
        solved: the solution without what joints say where they stand.
    """
    robot = solved.robot
    asked = [joint for joint in asked_joints(robot) if any(joint in p.recording.sticking for p in solved.problems)]
    if not asked:
        return solved
    noise, estimate = solved.problems[0].dynamics.steps.noise, solved.solution.estimate
    telling = anchored(_telling(solved.problems, asked), estimate.calibrations)
    try:
        solution = stage.step("friction at standstill", telling, noise, estimate, FEW_ITERATIONS)
        if solution.converged and _turns_over_in_sight(telling, solution.estimate.calibrations[0], asked):
            return stage.settled(telling, noise, solution.estimate)
    except SolveError:  # the law contradicts what it is asked for
        pass
    return _held_as_a_sign(stage, solved)


def sticking_joints(before: Robot, after: Robot) -> list[Notice]:
    """What is said about joints whose sharpness one robot looks for and another holds."""
    held = [joint for joint in asked_joints(before) if joint not in asked_joints(after)]
    return [
        Notice(
            after.motor_encoder.name,
            "info",
            1,
            f"{joint} sticks where it stands: its dry friction is a sign as far as its encoder tells a speed from none "
            f"({SATURATED / after.sharpness_of(joint):.2g} {after.unit_at(joint, 'rad/s')}), so friction_sharpness is "
            f"held at {after.sharpness_of(joint):.4g} {after.unit_at(joint, 's/rad')}",
        )
        for joint in held
    ]


def _telling(problems: Sequence[BagProblem], asked: Sequence[str]) -> list[BagProblem]:
    """The problems with what some joints say where they stand."""
    told = []
    for problem in problems:
        kept = {joint: times for joint, times in problem.recording.sticking.items() if joint not in asked}
        told.append(replace(problem, recording=replace(problem.recording, sticking=kept)).of_robot(problem.robot))
    return told


def _turns_over_in_sight(problems: Sequence[BagProblem], found: Calibration, asked: Sequence[str]) -> bool:
    """Whether the friction of some joints turns over at speeds that their encoder tells from none."""
    robot, recordings = problems[0].robot, [problem.recording for problem in problems]
    values = dict(zip(found.names, found.values.tolist(), strict=True))
    return all(
        values[f"{joint}.{SHARPNESS}"] * slowest_seen(robot, recording, joint) < SEEN
        for joint in asked
        for recording in recordings
    )


def _held_as_a_sign(stage: WholeStage, solved: Solved) -> Solved:
    """The solution with the sharpness of joints that stick held."""
    sharp = holding_sharpness(solved.robot, [problem.recording for problem in solved.problems])
    estimate, motions = solved.solution.estimate, len(solved.problems)
    known = [c.carried_to(Calibration.of(sharp)) for c in estimate.calibrations[:motions]]
    start = stage.with_sets(Estimate(estimate.states[:motions], tuple(known)))
    problems = anchored([problem.of_robot(sharp) for problem in solved.problems], known)
    return stage.settled(problems, solved.problems[0].dynamics.steps.noise, start)
