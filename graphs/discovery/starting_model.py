# SPDX-License-Identifier: BSD-3-Clause
"""The model with which a search begins, and by what it is judged all through: missing torque, or predictions.

Where an encoder tells torques that are far smaller than the missing one, it is asked of these, and friction at rest has
no say in the calibration. Elsewhere predictions are asked, and these go through standstills, so the calibration does,
too. A search that changed from one to the other when an effect came in would take for physics what the other left.

How sharply dry friction turns over is a number of the robot file that nobody measured. Where an encoder tells slower
speeds from none, the recordings are asked for it before any effect is: what a friction that is rounded off too much
leaves looks like one. Joints that truly stick contradict any rounded law where they stand, and bend the values of a
model that is asked of it: one calibrated while they move then predicts better, and torques are asked, noisy or not.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.base_model import BaseModel, seen_by_one_encoder
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.calibration.stages.near_solution import NearSolution
from jointscope.graphs.discovery.scored_candidates import segments_of
from jointscope.graphs.discovery.verdicts import MATTERS
from jointscope.graphs.judging.elastic_reaction import known_springs
from jointscope.graphs.judging.torque_judge import FEWEST_BLOCKS, TorqueJudge
from jointscope.graphs.judging.torque_rows import TorqueEquations
from jointscope.graphs.problem.standstill import ADDED_SPRING, SATURATED, slowest_seen
from jointscope.graphs.refits.loop_validation import judged_by_loop
from jointscope.graphs.refits.validation import fit_and_judge, judged_error
from jointscope.graphs.screening.felt_gravity import FELT_GRAVITY
from jointscope.graphs.screening.mistaken_transmission import MISTAKEN_TRANSMISSION
from jointscope.graphs.screening.screen_all import screen_all
from jointscope.graphs.solving.batch_solver import Solver, solve
from jointscope.robots.errors import EffectError, JointscopeError, RecordingError
from jointscope.robots.files.effect_editing import remove_effect
from jointscope.robots.model.robot import SHARPNESS, Robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.recordings.imu_plausibility import MIRRORED
from jointscope.robots.recordings.recording import Recording

BANDS = (30.0, 15.0, 8.0, 4.0)  # [Hz]
QUIET = 0.3  # of the missing torque: largest part that may be noise of the encoders
FEWEST_ROWS = 100
REFUSED = (MIRRORED, FELT_GRAVITY, MISTAKEN_TRANSMISSION)  # kinds of notices beside which nothing can be told
SHARPER = 1.5  # times the sharpness that the robot file says, from which another one is tried


def starting_model(robot: Robot, recordings: Sequence[Recording], solver: Solver = solve) -> BaseModel:
    """A robot calibrated for the measure by which it will be judged.

    Args:
        robot: the model with start values.
        recordings: training recordings.
        solver: minimises the cost of all samples.

    Raises:
        RecordingError: a gyroscope is of the other hand, an accelerometer feels another gravity, or the transmission
            is another one: nothing fits it, and every effect would be judged by how it bends.
    """
    for recording in recordings:
        _refuse_mistaken(robot, recording)
    return _by_its_measure(robot, recordings, solver)


def _refuse_mistaken(robot: Robot, recording: Recording) -> None:
    for notice in screen_all(recording, robot):
        if notice.kind in REFUSED:
            instead = "" if notice.kind == MISTAKEN_TRANSMISSION else f", or leave {notice.stream} out of it"
            raise RecordingError(
                f"{recording.path}: {notice.text}; no effect can be identified beside that: correct the robot "
                f"file{instead}, then search again"
            )


def _by_its_measure(robot: Robot, recordings: Sequence[Recording], solver: Solver) -> BaseModel:
    def by_predictions() -> BaseModel:
        return _as_sharp_as_told(BaseModel.of(robot, recordings, by_torques=False, solver=solver), solver)

    if not seen_by_one_encoder(robot) or judged_by_loop(robot, recordings):
        return by_predictions()
    moving = BaseModel.of(robot, recordings, by_torques=True, solver=solver)
    judge = torque_judge(moving)
    if judge is not None and is_quiet(judge):
        return moving
    standing = by_predictions()
    return moving if judge is not None and _predicts_better(_as_sharp_as(standing, moving), standing) else standing


def _as_sharp_as(other: BaseModel, base: BaseModel) -> BaseModel:
    """A model with the sharpness that another one has, values as they are: each predicts by what suits it best."""
    own = {joint: other.robot.sharpness_of(joint) for joint in base.robot.joints}
    return replace(base, robot=with_sharpness(base.robot, own))


def _predicts_better(model: BaseModel, than: BaseModel) -> bool:
    """Whether the error of a model's predictions is clearly the smaller one, standstills included."""
    try:
        error, other = (judged_error(b, b.robot, b.calibrations, fit_and_judge(b)[1]).error for b in (model, than))
    except JointscopeError:
        return False
    return error**2 < (1.0 - MATTERS) * other**2


def _as_sharp_as_told(base: BaseModel, solver: Solver = solve) -> BaseModel:
    """The model, or one whose dry friction turns over as sharply as the recordings say, if that predicts better.

    A true sign drives the sharpness up without an end: no sharper than what the encoder tells from one. Steps in which
    friction would stop a joint several times over drive it down, below that of the file: there that stays.
    """
    robot, told = base.robot, _told_sharpness(base.robot, base.recordings)
    if base.by_torques or not told:  # torques are asked while friction has its full size
        return base
    try:
        asked = with_sharpness(robot, {joint: robot.sharpness_of(joint) for joint in told}, fixed=False)
        near = NearSolution(base.calibrations)
        found = calibrate(asked, base.recordings, near=near, standstill=True, memory=False, solver=solver).robot
        held = {joint: min(found.sharpness_of(joint), most) for joint, most in told.items()}
        sharper = {joint: k for joint, k in held.items() if k > robot.sharpness_of(joint)}
        other = BaseModel.of(with_sharpness(robot, sharper), base.recordings, base, solver=solver)
    except JointscopeError:
        return base
    return other if _predicts_better(other, base) else base


def _told_sharpness(robot: Robot, recordings: Sequence[Recording]) -> dict[str, float]:
    """What encoders tell from a sign, of rigid joints without a sharpness of their own, where that is far sharper."""
    found = {}
    for joint in robot.joints:
        if joint in robot.layout.motors or f"{joint}.{SHARPNESS}" in robot.parameters:
            continue
        slowest = min(slowest_seen(robot, recording, joint) for recording in recordings)
        if np.isfinite(slowest) and slowest > 0.0 and SATURATED / slowest > SHARPER * robot.sharpness_of(joint):
            found[joint] = SATURATED / slowest
    return found


def with_sharpness(robot: Robot, sharpness: Mapping[str, float], fixed: bool = True) -> Robot:
    """The robot with the dry friction of some joints held to turn over so sharply, or beginning there [s/rad, s/m]."""
    document, parameters = copy.deepcopy(robot.document), dict(robot.parameters)
    for joint, value in sharpness.items():
        name, k, unit = f"{joint}.{SHARPNESS}", float(f"{value:.4g}"), robot.unit_at(joint, "s/rad")
        parameters[name] = Parameter(name, k, unit, k, k, fixed=fixed)
        document.setdefault("parameters", {})[name] = {"value": k, "unit": unit, "fixed": fixed}
    return replace(robot, parameters=parameters, document=document)


def turns_over_sharper(before: Robot, after: Robot) -> str:
    """What is said of a model that was given a sharpness which the robot file does not have; nothing for others."""
    new = {f"{joint}.{SHARPNESS}": joint for joint in after.joints}
    told = [joint for name, joint in new.items() if name in after.parameters and name not in before.parameters]
    if not told:
        return ""
    found = [f"{joint} at {after.sharpness_of(joint):.3g} {after.unit_at(joint, 's/rad')}" for joint in told]
    said = f"{before.sharpness_of(told[0]):.3g} {before.unit_at(told[0], 's/rad')}"
    return (
        f"Dry friction turns over more sharply than the robot file says ({said}); the model is judged with what the "
        f"recordings tell: {', '.join(found)}."
    )


def torque_judge(base: BaseModel, with_springs: bool = True) -> TorqueJudge | None:
    """The judge in the highest band in which the encoders are quiet, else in the lowest that has enough rows.

    Args:
        base: the model.
        with_springs: whether springs that were added stand in the equations of their motors as the reaction of what
            swings behind them; without, they are asked for again.

    Returns:
        None for a model that is judged by predictions, and for recordings that are too short.
    """
    if not base.by_torques or base.robot.layout.memories:
        return None
    rigid = _as_motors_move(base)
    if rigid is None:
        return None
    springs, found = known_springs(base.robot, rigid.robot) if with_springs else [], None
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
