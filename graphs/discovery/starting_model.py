# SPDX-License-Identifier: BSD-3-Clause
"""The model with which a search begins, and by what it is judged all through: missing torque, or predictions.

Where an encoder tells torques that are far smaller than the missing one, it is asked of these, and friction at rest has
no say in the calibration. Elsewhere predictions are asked, and these go through standstills, so the calibration does,
too. A search that changed from one to the other when an effect came in would take for physics what the other left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.base_model import BaseModel, seen_by_one_encoder
from jointscope.graphs.discovery.scored_candidates import segments_of
from jointscope.graphs.judging.elastic_reaction import known_springs
from jointscope.graphs.judging.torque_judge import FEWEST_BLOCKS, TorqueJudge
from jointscope.graphs.judging.torque_rows import TorqueEquations
from jointscope.graphs.problem.standstill import ADDED_SPRING
from jointscope.graphs.refits.loop_validation import judged_by_loop
from jointscope.graphs.solving.batch_solver import Solver, solve
from jointscope.robots.errors import EffectError
from jointscope.robots.files.effect_editing import remove_effect
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

BANDS = (30.0, 15.0, 8.0, 4.0)  # [Hz]
QUIET = 0.3  # of the missing torque: largest part that may be noise of the encoders
FEWEST_ROWS = 100


def starting_model(robot: Robot, recordings: Sequence[Recording], solver: Solver = solve) -> BaseModel:
    """A robot calibrated for the measure by which it will be judged.

    Args:
        robot: the model with start values.
        recordings: training recordings.
        solver: minimises the cost of all samples.
    """
    if not seen_by_one_encoder(robot) or judged_by_loop(robot, recordings):
        return BaseModel.of(robot, recordings, by_torques=False, solver=solver)
    base = BaseModel.of(robot, recordings, by_torques=True, solver=solver)
    judge = torque_judge(base)
    if judge is not None and is_quiet(judge):
        return base
    return BaseModel.of(robot, recordings, by_torques=False, solver=solver)


def torque_judge(base: BaseModel) -> TorqueJudge | None:
    """The judge in the highest band in which the encoders are quiet, else in the lowest that has enough rows.

    Returns:
        None for a model that is judged by predictions, and for recordings that are too short.

    Springs that were added stand in the equations of their motors as the reaction of what swings behind them.
    """
    if not base.by_torques or base.robot.layout.memories:
        return None
    rigid = _as_motors_move(base)
    if rigid is None:
        return None
    springs, found = known_springs(base.robot, rigid.robot), None
    segments = [s for bag in range(len(base.recordings)) for s in segments_of(rigid, bag)]
    for band in BANDS:
        equations = TorqueEquations.of(segments, band, springs)
        if any(len(np.unique(rows.times)) < FEWEST_ROWS for rows in equations.rows):
            break
        judge = TorqueJudge(equations)
        if any(len(np.unique(blocks)) < FEWEST_BLOCKS for blocks in judge.blocks):
            break
        found = judge
        if is_quiet(judge):
            break
    return found


def is_quiet(judge: TorqueJudge) -> bool:
    """Whether the noise of the encoders in the judge's band is small beside what is missing at every joint."""
    band, h = judge.equations.band, judge.equations.period
    robot = judge.equations.steps[0].segment.problem.robot
    turn = (2.0 * np.pi * band) ** 2 * np.sqrt(2.0 * h * band)
    noise = robot.free_inertias() * turn * robot.motor_encoder.sigmas
    return bool(np.all(noise < QUIET * judge.missing))


def _as_motors_move(base: BaseModel) -> BaseModel | None:
    """The model without its springs, whose joints move as the motors do; None where another effect needs a spring."""
    robot, layout = base.robot, base.layout
    if not layout.motors:
        return base
    if not all(robot.has_effect(ADDED_SPRING, joint) for joint in layout.motors):
        return None
    try:
        for joint in layout.motors:
            robot = remove_effect(robot, f"{ADDED_SPRING}@{joint}")
    except EffectError:
        return None
    states = []
    for x in base.states:
        moved = np.zeros((len(x), robot.layout.size))
        moved[:, robot.layout.joint_q], moved[:, robot.layout.joint_v] = x[:, layout.motor_q], x[:, layout.motor_v]
        states.append(moved)
    calibrations = tuple(Calibration.of(robot) for _ in states)
    return replace(base, robot=robot, states=tuple(states), calibrations=calibrations)
