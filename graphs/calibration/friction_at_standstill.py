# SPDX-License-Identifier: BSD-3-Clause
"""What a joint that stands says of its dry friction, where how sharply that turns over is looked for.

Motion comes first: as far as the encoder tells it from standing, it says how friction grows with speed. Then standstill
is asked, too, approached anew from the measurements, with loose noise and then with that of the windows: states that no
law held are thousands of sigmas from any, and with the small noise that motion ends at no step leads there. Where that
ends at a law that turns over at speeds which the encoder sees, and that takes no more noise than motion asks for,
standstill says the rest. Where it does not, the joint sticks: its friction is a sign, whose sharpness would grow
without an end, and it is held as sharp as the encoder tells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointscope.factors.calibration import DYNAMICS, Calibration, rotation_block
from jointscope.graphs.calibration.stages.convergence_asked import must_converge
from jointscope.graphs.calibration.stages.solved import Solved
from jointscope.graphs.calibration.stages.solved_windows import anchored
from jointscope.graphs.calibration.stages.whole_stage import (
    BELOW_ITERATIONS,
    FEW_ITERATIONS,
    MOST_ITERATIONS,
    SMALL_STEP,
    WholeStage,
)
from jointscope.graphs.noise.lasting_noise import states_in
from jointscope.graphs.noise.noise_estimation import densities, estimate_noise, scaled
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.standstill import SATURATED, asked_joints, holding_sharpness, slowest_seen
from jointscope.graphs.problem.windows import windows_of
from jointscope.graphs.solving.estimate import Estimate
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import SHARPNESS, Robot
from jointscope.robots.parts.process_noise import ProcessNoise
from jointscope.robots.recordings.recording import Notice, Recording

SEEN = 1.0  # of a law tanh(x), the x of the slowest speed that the encoder tells from none
STANDING = 2.0  # times the noise of the motion, from which joints that truly stick explain what windows ask for
CONTRADICTS = 2.0  # times the noise that motion alone asks for, where standstill contradicts the law


def asked_at_standstill(
    stage: WholeStage, problems: Sequence[BagProblem], noise: ProcessNoise, calibrations: Sequence[Calibration]
) -> Solved:
    """The solution in which standstill says its part about the sharpness of friction, or that a joint sticks.

    Args:
        stage: solves.
        problems: the recordings without what joints say where they stand.
        noise: where it begins.
        calibrations: values that windows found.
    """
    robot = problems[0].robot
    asked = [joint for joint in asked_joints(robot) if any(joint in p.recording.sticking for p in problems)]
    if not asked:
        return stage.solve(problems, noise, calibrations)
    estimate = stage.approached(problems, noise, calibrations)
    moving = stage.step("friction in motion", problems, noise, estimate, MOST_ITERATIONS)
    must_converge(moving, robot, SMALL_STEP)
    try:
        found = _told(stage, problems, asked, noise, moving.estimate.calibrations)
    except SolveError:  # the law contradicts what it is asked for
        found = None
    return found or _held_as_a_sign(stage, problems, noise, moving.estimate)


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


def _told(
    stage: WholeStage,
    problems: Sequence[BagProblem],
    asked: Sequence[str],
    noise: ProcessNoise,
    calibrations: Sequence[Calibration],
) -> Solved | None:
    """The solution with what some joints say where they stand; None where their friction is no law in sight."""
    telling = anchored(_telling(problems, asked), calibrations)
    estimate = stage.approached(telling, noise, calibrations[: len(problems)])
    for solved in stage.passes(telling, noise, estimate, BELOW_ITERATIONS):
        if not _turns_over_in_sight(solved.problems, solved.solution.estimate.calibrations[0], asked):
            return None
    if not _takes_no_more_noise(stage, problems, solved):
        return None
    return stage.with_short_impacts(stage.from_both_sides(solved))


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
    values = found.by_name
    return all(
        values[f"{joint}.{SHARPNESS}"] * slowest_seen(robot, recording, joint) < SEEN
        for joint in asked
        for recording in recordings
    )


def _takes_no_more_noise(stage: WholeStage, moving: Sequence[BagProblem], told: Solved) -> bool:
    """Whether motion alone asks for as much noise as motion and standstill together.

    A joint that truly sticks under a rounded law can be explained by random torques: these would show here.
    """
    if not told.robot.noise.estimate:
        return True
    noise, estimate = told.problems[0].dynamics.steps.noise, told.solution.estimate
    alone = anchored([problem.of_robot(told.robot) for problem in moving], estimate.calibrations)
    problems = [problem.with_noise(noise) for problem in alone]
    solution = stage.step("friction in motion", alone, noise, estimate, FEW_ITERATIONS)
    wanted = scaled(noise, Solved.of(problems, solution, stage.hold, told.sets).evidence.factors)
    return bool(np.all(densities(noise) < CONTRADICTS * densities(wanted)))


def _held_as_a_sign(
    stage: WholeStage, problems: Sequence[BagProblem], noise: ProcessNoise, estimate: Estimate
) -> Solved:
    """The solution with the sharpness of joints that stick held; arguments as in `asked_at_standstill`."""
    sharp = holding_sharpness(problems[0].robot, [problem.recording for problem in problems])
    motions = len(problems)
    known = [c.carried_to(Calibration.of(sharp)) for c in estimate.calibrations[:motions]]
    start = stage.with_sets(Estimate(estimate.states[:motions], tuple(known)))
    return stage.finished(anchored([problem.of_robot(sharp) for problem in problems], known), noise, start)


def noise_with_standstills(recordings: Sequence[Recording], solved: Solved, begin: ProcessNoise) -> ProcessNoise:
    """What windows ask for, with what joints do where they stand, at values that are known.

    Args:
        recordings: all of them.
        solved: values and states near those of the windows.
        begin: noise with which the estimation begins.
    """
    found, problems = solved.solution.estimate, solved.problems
    pieces = windows_of(recordings)
    calibrations = tuple(found.calibrations[i] for i, _ in pieces)
    windows = anchored(
        [BagProblem.of(problems[0].robot, piece, problems[i].between) for i, piece in pieces], calibrations
    )
    windows = [window.with_noise(begin) for window in windows]
    whole = [(problems[i], found.states[i]) for i, _ in pieces]
    states = tuple(states_in(window, *of) for window, of in zip(windows, whole, strict=True))
    hold = (DYNAMICS, *(rotation_block(gyro.name) for gyro in problems[0].robot.gyros))
    return estimate_noise(windows, Estimate(states, calibrations), hold=hold)[0]


def with_standstills(noise: ProcessNoise, moving: ProcessNoise, all_of_it: ProcessNoise) -> ProcessNoise:
    """Noise of a filter that goes through standstills, too, where these ask for far more than motion does.

    Args:
        noise: what was found.
        moving: the same without what lasts, as motion asks for it.
        all_of_it: what motion and standstills ask for.
    """
    more = densities(all_of_it) / densities(moving)
    factors = np.where(more > STANDING, more, 1.0)
    return scaled(noise, np.concatenate([factors, np.ones(noise.n_lasting)]))
