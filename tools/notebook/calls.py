# SPDX-License-Identifier: BSD-3-Clause
"""The verbs as functions: robots by name, path or object, recordings by path or object; errors are JointscopeErrors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jointscope.graphs.calibration.calibrate import calibrate as calibrate_motion
from jointscope.graphs.calibration.calibration_graph import CalibrationGraph
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.comparison.compare import compare as compare_motion
from jointscope.graphs.discovery.diagnose import diagnose as diagnose_motion
from jointscope.graphs.discovery.discover import Save
from jointscope.graphs.discovery.discover import discover as discover_motion
from jointscope.graphs.discovery.discovery_result import SavedStep
from jointscope.graphs.discovery.side_by_side import SideBySide
from jointscope.graphs.joint_kinds.arm_graph import ArmCalibration, arm_graph
from jointscope.graphs.joint_kinds.beside_motion import calibrate_beside_motion
from jointscope.graphs.rests.rests_beside_motion import weighted_rests, with_rests
from jointscope.graphs.solving.batch_solver import Progress, Solver, solve
from jointscope.graphs.solving.set_problem import SetProblem
from jointscope.graphs.transmission.calibrate_links import calibrate_links
from jointscope.graphs.transmission.compare_links import compare_links
from jointscope.graphs.transmission.diagnose_links import diagnose_links
from jointscope.graphs.transmission.discover_links import discover_links
from jointscope.robots.errors import RecordingError, RobotError, SolveError
from jointscope.tools.acceptance.evaluation import check_models
from jointscope.tools.bags.needed_streams import check_same_streams
from jointscope.tools.bags.read_locked import read_coupling
from jointscope.tools.notebook.given import (
    AnyLimits,
    AnyRecording,
    AnyRobot,
    AnyStretches,
    labelled,
    limits_of,
    recordings_of,
    robot_of,
    to_learn_from,
    without_stretches,
)
from jointscope.tools.notebook.kinds_calls import AnyPoses, AnyRests, AnyShaken, Still, diagnosed, discovered
from jointscope.tools.notebook.kinds_results import KindsDiagnosed, KindsDiscovered
from jointscope.tools.notebook.results import Calibrated, Compared, Diagnosed, Discovered
from jointscope.tools.verb_parts.frequency_runs import read_all_shaken
from jointscope.tools.verb_parts.named_recordings import diagnosis_of, discovery_of
from jointscope.tools.verb_parts.pose_runs import weighted_poses
from jointscope.tools.verb_parts.rest_runs import read_all_rests
from jointscope.tools.verdicts.judgement import judge


def calibrate(
    robot: AnyRobot,
    recordings: AnyRecording | Sequence[AnyRecording],
    *,
    rests: Sequence[str | Path] = (),
    poses: Sequence[str | Path] = (),
    frequency: Sequence[str | Path] = (),
    locked_springs: Sequence[str | Path] = (),
    sets: Sequence[SetProblem] = (),
    accept: AnyLimits = (),
    leave_out: AnyStretches = (),
    biases_only: bool = False,
    solver: Solver = solve,
    progress: Progress | None = None,
) -> Calibrated:
    """Finds the parameters of a robot from one or more recordings, with their uncertainties.

    Args:
        robot: model with start values and priors.
        recordings: of motion; parameters and mountings are shared, states and biases are each recording's own.
        rests: bags in which the robot stands, with weights on it or without, for the same estimate.
        poses: tables or bags of the arm at rest with a measured target, for the same estimate.
        frequency: bags in which the arm is shaken, one for each pose, for the same estimate.
        locked_springs: bags in which springs are locked mechanically, for the same estimate: they show the matrix
            between motors and links, whose elements become parameters.
        sets: recordings of other kinds that you have made yourself, for the same estimate.
        accept: limits that the result must meet (docs/accept.md); `result.accepted` says whether it does.
        leave_out: stretches in which something acted that does not belong to the robot: (t0, t1) [s] of the only
            recording, or "BAG:T0:T1" as on the command line.
        biases_only: leave dynamics and mountings as they are.
        solver: minimises the cost of all samples.
        progress: called with a text and the share done, from 0 to 1.

    Raises:
        RecordingError: a recording cannot be a measurement of this robot, or does not move a joint.
        SolveError: no convergence, or a value that nothing determines.
    """
    model = robot_of(robot)
    limits = limits_of(accept, [model])
    if isinstance(recordings, Sequence) and not recordings and (rests or poses or frequency):
        raise RecordingError(
            "no recording of motion is given; from poses alone call calibrate_poses(robot, [read_poses(path, robot)]), "
            "as docs/poses.md shows, from rests or frequency responses alone `jointscope calibrate` on the command line"
        )
    if rests or poses or frequency or locked_springs:
        model.need_link_dynamics()
    if locked_springs:
        coupling = read_coupling(locked_springs, model)
        model = coupling.of_robot()
        sets = [*sets, *coupling.sets(model)]
    read_ones = without_stretches(recordings_of(recordings, model), leave_out)
    if model.free_links:
        found = calibrate_links(model, read_ones, progress=progress)
    else:
        report, paths = progress or _quiet, [[Path(path) for path in each] for each in (rests, poses, frequency)]
        placed, at_poses = weighted_poses(model, paths[1], report)
        placed, at_rest = weighted_rests(placed, read_ones, read_all_rests(paths[0], placed, report), report)
        all_sets = [*sets, *at_rest, *at_poses]
        options: dict[str, Any] = {"biases_only": biases_only, "solver": solver, "sets": all_sets, "progress": progress}
        shaken = read_all_shaken(placed, paths[2], report)
        if shaken:
            found = calibrate_beside_motion(placed, read_ones, shaken, **options)
        else:
            found = calibrate_motion(placed, read_ones, **options)
    found = with_rests(found)
    content = {model.name: found.to_json() | judge(found).to_json()} if limits else {}
    return Calibrated.of(found, acceptance=check_models(limits, content))


def compare(
    robots: AnyRobot | Sequence[AnyRobot] | Mapping[str, AnyRobot],
    recording: AnyRecording,
    *,
    leave_out: AnyStretches = (),
    accept: AnyLimits = (),
    progress: Progress | None = None,
) -> Compared:
    """Predicts a recording with one or more models, and tells how far off they are, where and when.

    Args:
        robots: one, several, or several with labels.
        recording: one that no model was fitted to.
        leave_out: stretches in which something acted that does not belong to the robot: (t0, t1) [s] of the only
            recording, or "BAG:T0:T1" as on the command line.
        accept: limits that each model must meet (docs/accept.md); `result.accepted` says whether they do.
        progress: called with a text and the share done, from 0 to 1.

    Raises:
        RobotError: two robots have the same name and no labels, or read different topics.
        RecordingError: the recording cannot be a measurement of these robots.
    """
    models = labelled(robots)
    limits = limits_of(accept, models.values())
    check_same_streams(models)
    first = next(iter(models.values()))
    (read_one,) = without_stretches(recordings_of([recording], first), leave_out)
    found = (compare_links if first.free_links else compare_motion)(models, read_one, progress=progress)
    return Compared.of(found, acceptance=check_models(limits, found.to_json()["models"] if limits else {}))


def diagnose(
    robot: AnyRobot,
    recordings: AnyRecording | Sequence[AnyRecording],
    holdout: AnyRecording | None = None,
    *,
    rests: AnyRests = (),
    poses: AnyPoses = (),
    frequency: AnyShaken = (),
    holdout_rests: AnyRests = (),
    holdout_poses: AnyPoses = (),
    holdout_frequency: AnyShaken = (),
    leave_out: AnyStretches = (),
    missing_torque: bool = True,
    accept: AnyLimits = (),
    side_by_side: SideBySide | None = None,
    progress: Progress | None = None,
) -> Diagnosed | KindsDiagnosed:
    """Ranks the physical effects that a model may lack, each with its evidence.

    Args:
        robot: is calibrated first.
        recordings: of motion, to learn from; [] where there are rests and poses, say. Candidates are judged on blocks
            that their fits leave out.
        holdout: is scored and reported, and never chooses.
        rests: bags in which the robot stands: every kind is asked, each in its own graph (docs/frequency.md).
        poses: tables or bags of the arm at rest with a measured target.
        frequency: bags in which the arm is shaken, one for each pose.
        holdout_rests: rests that are scored and never choose.
        holdout_poses: poses of that sort.
        holdout_frequency: frequency responses of that sort.
        leave_out: stretches in which something acted that does not belong to the robot: (t0, t1) [s] of the only
            recording, or "BAG:T0:T1" as on the command line.
        missing_torque: estimate the torque that the model lacks, for the pictures.
        accept: limits that the model must meet (docs/accept.md); `result.accepted` says whether it does.
        side_by_side: processes that fit the candidates; this one alone if not given.
        progress: called with a text and the share done, from 0 to 1.

    Raises:
        RecordingError: a recording cannot be a measurement of this robot.
        SolveError: the base model cannot be calibrated.
    """
    given = robot_of(robot)
    still = Still(rests, poses, frequency, Still(holdout_rests, holdout_poses, holdout_frequency))
    if still.some:
        if accept:
            raise RobotError(
                "accept: limits do not apply to a diagnosis of several kinds; calibrate takes them with all"
            )
        asked: dict[str, Any] = {"missing_torque": missing_torque, "side_by_side": side_by_side}
        return diagnosed(given, recordings, holdout, still, leave_out, progress, **asked)
    limits = limits_of(accept, [given])
    model, learnt, held = to_learn_from(given, recordings, holdout, leave_out)
    if model.free_links:
        found = diagnose_links(model, learnt, held, progress=progress)
    else:
        options: dict[str, Any] = {"missing_torque": missing_torque, "side_by_side": side_by_side, "progress": progress}
        found = diagnose_motion(model, learnt, held, **options)
    predicted = found.comparison.to_json() if found.comparison is not None else {}
    content = {model.name: predicted | found.to_json()} if limits else {}
    return Diagnosed.of(diagnosis_of(found, learnt, held), acceptance=check_models(limits, content))


def discover(
    robot: AnyRobot,
    recordings: AnyRecording | Sequence[AnyRecording],
    holdout: AnyRecording | None = None,
    *,
    rests: AnyRests = (),
    poses: AnyPoses = (),
    frequency: AnyShaken = (),
    holdout_rests: AnyRests = (),
    holdout_poses: AnyPoses = (),
    holdout_frequency: AnyShaken = (),
    leave_out: AnyStretches = (),
    missing_torque: bool = True,
    save: Save | None = None,
    resume: Sequence[SavedStep] | None = None,
    side_by_side: SideBySide | None = None,
    progress: Progress | None = None,
) -> Discovered | KindsDiscovered:
    """Calibrates, diagnoses, adds what is missing, and repeats until nothing helps.

    Args:
        robot: the base model.
        recordings: of motion, to learn from; [] where there are rests and poses, say. Candidates are judged on blocks
            that their fits leave out.
        holdout: is scored once per step, and never chooses.
        rests: bags in which the robot stands: one model is grown by every kind (docs/frequency.md).
        poses: tables or bags of the arm at rest with a measured target.
        frequency: bags in which the arm is shaken, one for each pose.
        holdout_rests: rests that are scored and never choose.
        holdout_poses: poses of that sort.
        holdout_frequency: frequency responses of that sort.
        leave_out: stretches in which something acted that does not belong to the robot: (t0, t1) [s] of the only
            recording, or "BAG:T0:T1" as on the command line.
        missing_torque: estimate the torque that each model lacks, for the pictures.
        save: called with the number of each finished step and the step; returns the robot file it wrote.
        resume: finished steps of an earlier run; the search goes on after the last.
        side_by_side: processes that fit the candidates; this one alone if not given.
        progress: called with a text and the share done, from 0 to 1.

    Raises:
        RecordingError: a recording cannot be a measurement of this robot.
        SolveError: the base model cannot be calibrated.
    """
    still = Still(rests, poses, frequency, Still(holdout_rests, holdout_poses, holdout_frequency))
    if still.some:
        if save is not None or resume is not None:
            raise RecordingError("save, resume: a search over several kinds keeps no steps; leave them out")
        asked = {"missing_torque": False, "side_by_side": side_by_side}
        return discovered(robot, recordings, holdout, still, leave_out, progress, **asked)
    model, learnt, held = to_learn_from(robot, recordings, holdout, leave_out)
    options: dict[str, Any] = {"save": save, "resume": resume, "progress": progress}
    if model.free_links:
        return Discovered.of(discovery_of(discover_links(model, learnt, held, **options), learnt, held))
    options |= {"missing_torque": missing_torque, "side_by_side": side_by_side}
    return Discovered.of(discovery_of(discover_motion(model, learnt, held, **options), learnt, held))


def graph(result: CalibrationResult | ArmCalibration, per_sample: bool = False) -> CalibrationGraph:
    """The GTSAM graph of a calibration.

    Args:
        result: of `calibrate`; also of `calibrate_poses`, `calibrate_frequency`, `calibrate_kinds` and
            `calibrate_with_rests`.
        per_sample: one factor for every sample, instead of one for every thousand; of motion alone.

    Raises:
        SolveError: no result of a calibration; a factor for every sample, and other recordings than motion.
    """
    if isinstance(result, CalibrationResult):
        return CalibrationGraph.of(result, per_sample)
    if not isinstance(result, ArmCalibration):
        raise SolveError(
            f"a graph belongs to a calibration: expected the result of calibrate, got {type(result).__name__}; "
            'for example graph(calibrate("doggy", "train.mcap"))'
        )
    if per_sample:
        raise SolveError("a factor for every sample (per_sample) takes recordings of motion only; leave it out")
    return arm_graph(result)


def _quiet(text: str, share: float) -> None:
    """Nobody looks."""
