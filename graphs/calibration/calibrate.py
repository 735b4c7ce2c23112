# SPDX-License-Identifier: BSD-3-Clause
"""Batch calibration: recordings and a robot in, a calibrated robot with uncertainties out.

Stages: 1. states from the measurements, parameters by regression; 2. windows of the recordings, where parameters and
process noise are found; 3. all samples of all recordings; 4. uncertainties. Nothing is tuned to one robot.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration, rotation_block
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.calibration.calibration_summary import summarize
from jointscope.graphs.calibration.causes import asked_for_causes
from jointscope.graphs.calibration.current_delay import solved_with_current_delay
from jointscope.graphs.calibration.encoder_filters import (
    free_filters,
    solved_with_filters,
    with_filters,
)
from jointscope.graphs.calibration.failures_with_notices import names_notices
from jointscope.graphs.calibration.friction_at_standstill import (
    asked_at_standstill,
    noise_with_standstills,
    sticking_joints,
    with_standstills,
)
from jointscope.graphs.calibration.stages.encoder_noise import with_visible_noise
from jointscope.graphs.calibration.stages.history import History
from jointscope.graphs.calibration.stages.near_solution import NearSolution
from jointscope.graphs.calibration.stages.solved import Solved
from jointscope.graphs.calibration.stages.solved_windows import anchored
from jointscope.graphs.calibration.stages.whole_stage import LOOSE, WholeStage, blunt_sharpness, blunted
from jointscope.graphs.calibration.turned_mounting import held, released, turned_without_reason
from jointscope.graphs.gtsam_solvers.samples_solver import must_be_short, solve_samples
from jointscope.graphs.noise.lasting_noise import without_lasting
from jointscope.graphs.noise.noise_estimation import estimate_noise, not_below
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.standstill import leaving_standstill_out
from jointscope.graphs.problem.windows import windows_of
from jointscope.graphs.screening.current_delay import with_current_constants, with_current_delay
from jointscope.graphs.screening.screen_all import screen_all
from jointscope.graphs.solving.batch_solver import Progress, Solver, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.set_problem import SetProblem
from jointscope.graphs.solving.solver_context import give_back_memory, in_solver_context
from jointscope.graphs.starts.drive_signal import told_drive_signal
from jointscope.graphs.starts.initial_guess import initial_biases, initial_dynamics, initial_states
from jointscope.graphs.starts.second_opinion import on_their_word, regressed_values
from jointscope.graphs.starts.spring_knots import with_knots
from jointscope.graphs.starts.time_shift_start import with_best_shifts
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.process_noise import ProcessNoise
from jointscope.robots.recordings.recording import TOLD_WITH_RESULTS, Notice, Recording, must_count_once
from jointscope.robots.recordings.resting_joints import must_move

Array = NDArray[np.float64]

WINDOW_ITERATIONS = 12
TOLD_OF_WHITE = (
    "timing",
    "masses",
    "lacking",
    "inertia_shifts",
    "asked",
    "torque_readings",
)  # what torques that last would hide


@in_solver_context
@names_notices
def calibrate(
    robot: Robot,
    recordings: Sequence[Recording],
    *,
    biases_only: bool = False,
    near: NearSolution | None = None,
    standstill: bool = False,
    solver: Solver = solve,
    sets: Sequence[SetProblem] = (),
    memory: bool = True,
    progress: Progress | None = None,
) -> CalibrationResult:
    """Calibrates a robot with one or more recordings.

    Args:
        robot: model with start values and priors.
        recordings: at least one; parameters and rotations are shared, states and biases are each recording's own.
        biases_only: estimate states, biases and process noise only; dynamics and mounting stay as they are.
        near: a point near the solution, where the robot's own values and noise are, too: nothing is guessed, no windows
            are cut.
        standstill: whether friction is asked for its law where a joint stands or turns over, too, as where effects of
            slow motion are looked for; else what these moments say is left out.
        solver: minimises the cost of all samples; start values and a first noise come from windows, whatever it is.
        sets: recordings of other kinds than motion, which share the robot's values.
        memory: whether random torques may last, where the recordings say so, and effects that would change the values
            are asked for; without, random torques are white, as a search for effects wants them.
        progress: called with a text and the share done, from 0 to 1.

    Raises:
        RecordingError: a recording cannot be a measurement of this robot, or does not move a joint.
        SolveError: no convergence, or a state or parameter that nothing determines.
    """
    started = time.perf_counter()
    report = progress or (lambda text, share: None)
    robot = with_knots(robot, recordings)
    result = _calibrated(robot, recordings, biases_only, near, standstill, solver, sets, memory, report)
    turned = turned_without_reason(robot, result) if near is None and not biases_only else {}
    if turned:
        report("again, with mountings held", 0.0)
        anew = _calibrated(held(robot, turned), recordings, False, None, standstill, solver, sets, memory, report)
        result = released(robot, anew, turned)
    report("done", 1.0)
    give_back_memory()
    return replace(result, wall_seconds=time.perf_counter() - started)


def _calibrated(
    robot: Robot,
    recordings: Sequence[Recording],
    biases_only: bool,
    near: NearSolution | None,
    standstill: bool,
    solver: Solver,
    sets: Sequence[SetProblem],
    memory: bool,
    report: Progress,
) -> CalibrationResult:
    """One calibration; arguments as in `calibrate`."""
    notices = check_recordings(robot, recordings, every_joint=not biases_only)
    robot, found = told_drive_signal(robot, recordings)
    if near is None:
        robot, late = with_current_delay(robot, recordings)
        found += late
    notices += found
    if robot.noise.estimate:
        robot = without_lasting(robot)
    noise = _loose(robot.noise) if robot.noise.estimate and near is None else robot.noise
    seen = with_visible_noise(robot, recordings) if near is None and not biases_only else robot
    filters = free_filters(robot) if near is None and not biases_only else ()
    seen = with_filters(seen, {name: robot.parameters[name].value for name in filters}, fixed=True)
    told = list(recordings)
    if not biases_only and not standstill:
        told = [leaving_standstill_out(seen, recording) for recording in recordings]
    problems = [BagProblem.of(replace(seen, noise=noise), recording) for recording in told]
    if solver is solve_samples:
        must_be_short(problems)
    hold = (DYNAMICS, *(rotation_block(gyro.name) for gyro in robot.gyros)) if biases_only else ()
    history = History()
    if near is None:
        blunt = blunt_sharpness(seen, recordings)[:1]
        plain = [problem.of_robot(problem.robot.without(seen.accelerometers)) for problem in problems]
        plain = plain if seen.accelerometers else problems
        first = [blunted(problem, sharpness) for problem in plain for sharpness in blunt] or plain
        # with what standstills say: friction has not been found yet, and small noise makes far starts farther
        noise, calibrations = _windows_stage(recordings, first, hold, history, _part(report, 0.0, 0.4))
        calibrations = [c.carried_to(Calibration.of(seen)) for c in calibrations]
    else:
        calibrations = [Calibration.of(robot).with_points(c.own) for c in near.calibrations]
    problems = anchored(problems, calibrations)
    stated = {e.name: e.sigmas for e in (seen.motor_encoder, seen.link_encoder) if e is not None}
    anew = near is None and not biases_only
    stage = WholeStage(hold, history, _part(report, 0.4, 1.0), anew, solver, sets, stated, near=near)
    solve_all = stage.solve if biases_only or standstill else partial(asked_at_standstill, stage)
    solved = solve_all(problems, noise, calibrations)
    solved = solved_with_filters(stage, solved, filters) if filters else solved
    solved = solved_with_current_delay(stage, solved, recordings) if near is None else solved
    if not biases_only and not standstill:
        notices += sticking_joints(robot, solved.robot)
        robot = replace(robot, parameters=solved.robot.parameters)
    # the file that will be written says in which posture its values were found
    robot = robot.locked_as_in(recordings[0].posture)
    result = summarize(robot, solved, tuple(history.records), notices, hold)
    solved = replace(solved, spreads=[])  # they are large, and all that they say has been said
    if near is None and not biases_only:
        result = asked_for_causes(result, solved, stage if memory else None, recordings)
        if memory and not result.has_named_causes:  # else torques that last would hide them
            lasting = stage.with_memory(solved)
            if lasting is not solved:
                other = summarize(robot, lasting, tuple(history.records), notices, hold)
                result = replace(other, **{name: getattr(result, name) for name in TOLD_OF_WHITE})
        regressed = regressed_values(result.robot, recordings)
        said = (*result.findings, *on_their_word(result.robot, regressed))
        result = replace(result, regressed=regressed, findings=said)
    if any(recording.sticking for recording in told):
        if near is not None and robot.noise.estimate:  # the noise at hand is that of another model
            noise = noise_with_standstills(recordings, solved, noise)
        result = _with_noise_of_standstills(result, solved, noise)
    return result


def _with_noise_of_standstills(result: CalibrationResult, solved: Solved, noise: ProcessNoise) -> CalibrationResult:
    """The result with noise that standstills were asked for, too."""
    moving = solved.problems[0].dynamics.steps.noise
    return replace(result, robot=replace(result.robot, noise=with_standstills(result.noise, moving, noise)))


def check_recordings(robot: Robot, recordings: Sequence[Recording], every_joint: bool = True) -> list[Notice]:
    """Screens all recordings; every joint must move in at least one of them.

    Raises:
        RecordingError: as the screening says, or joints that never move.
    """
    if not recordings:
        raise RecordingError("no recording given; pass at least one bag")
    must_count_once((recording.path, recording.sha256) for recording in recordings)
    notices = [notice for recording in recordings for notice in recording.notices if notice.kind in TOLD_WITH_RESULTS]
    notices += [notice for recording in recordings for notice in screen_all(recording, robot)]
    if every_joint:
        must_move(robot, recordings)
    return notices


def _windows_stage(
    recordings: Sequence[Recording],
    problems: Sequence[BagProblem],
    hold: tuple[str, ...],
    history: History,
    progress: Progress,
) -> tuple[ProcessNoise, list[Calibration]]:
    """Parameters and noise from windows; returns the noise and a calibration for each recording."""
    progress("first guess", 0.0)
    robot = problems[0].robot
    pieces = windows_of(recordings)
    bags = [initial_biases(problem, Calibration.of(robot)) for problem in problems]
    windows = [BagProblem.of(robot, piece) for _, piece in pieces]
    calibrations = [bags[i] for i, _ in pieces]
    states = [initial_states(w, c) for w, c in zip(windows, calibrations, strict=True)]
    if not hold:
        # the regression filters its signals and wants them long
        whole = [initial_states(problem, bag) for problem, bag in zip(problems, bags, strict=True)]
        guess = with_current_constants(initial_dynamics(problems, whole, bags[0]), robot, recordings)
        calibrations = [c.with_points({DYNAMICS: guess.dynamics}) for c in calibrations]
    windows, estimate = with_best_shifts(windows, Estimate(tuple(states), tuple(calibrations)), hold)
    # nearly linear in the states alone: bring them to the parameters before both move
    solution = solve(windows, estimate, max_iterations=4, step_tolerance=0.5, hold=(DYNAMICS,))
    history.add("states", solution)
    if not hold:
        # only a start for the whole recording: what windows leave open may go on wandering
        solution = solve(windows, solution.estimate, max_iterations=WINDOW_ITERATIONS, step_tolerance=0.3)
        history.add("windows", solution)
    noise, estimate = robot.noise, solution.estimate
    if noise.estimate:
        noise, estimate = estimate_noise(windows, estimate, hold=hold, progress=_part(progress, 0.3, 1.0))
    found = estimate.calibrations[0]
    return noise, [bag.with_points(found.common) for bag in bags]


def _loose(noise: ProcessNoise) -> ProcessNoise:
    """Noise with which any start value can be approached; the estimation goes down from there."""
    return not_below(noise, LOOSE)


def _part(progress: Callable[[str, float], None], start: float, stop: float) -> Progress:
    """A progress that fills a part of another."""
    return lambda text, share: progress(text, start + (stop - start) * share)
