# SPDX-License-Identifier: BSD-3-Clause
"""Rests in one graph with poses, frequency responses or both, without motion.

Each side is calibrated alone first: that finds the weights of the rests, the stages of the responses, and values near
the end. Then all stand in one graph, the responses as their Gaussian factor, and friction has the moments of its
posterior (band_posterior.py), as where rests are alone or beside motion.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.found_values import derived_results, dynamic_parameters
from jointscope.graphs.frequency.agreement import Agreement, agreement
from jointscope.graphs.frequency.calibrate_frequency import FrequencyCalibration, calibrate_frequency
from jointscope.graphs.joint_kinds.all_kinds import (
    AllKinds,
    StillCalibration,
    frequency_of,
    poses_of,
    solve_all_kinds,
    told_by,
)
from jointscope.graphs.joint_kinds.calibrate_kinds import KindsCalibration, calibrate_kinds
from jointscope.graphs.poses.calibrate_poses import PoseCalibration, calibrate_poses
from jointscope.graphs.rest_sets.rest_errors import rest_errors
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.band_posterior import band_posterior
from jointscope.graphs.rests.calibrate_rests import RestCalibration, calibrate_rests, check_bands
from jointscope.graphs.rests.doubts import AskedOfRests
from jointscope.graphs.rests.rests_by_values import SaidElsewhere
from jointscope.graphs.rests.unnoticed import unnoticed
from jointscope.graphs.solving.batch_solver import Progress, Solution
from jointscope.graphs.solving.set_problem import SetProblem
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.graphs.starts.spring_knots import with_knots
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import with_sigmas
from jointscope.robots.recordings.poses import Poses
from jointscope.robots.recordings.signals import Excitation, Signals
from jointscope.robots.rests.rests import Rests

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WithRests:
    """Result of a calibration from rests and other kinds without motion.

    Attributes:
        robot: with the values that were found and their sigmas.
        rests: what the rests are at these values.
        others: what the other kinds are at them, with the sigmas of all.
        agreement: whether the rests tell what the others tell.
        problems: all recordings, as they stand in the graph: poses, responses, rests.
        solution: of these, friction where it is likeliest.
        wall_seconds: of the whole.
    """

    robot: Robot
    rests: RestCalibration
    others: StillCalibration
    agreement: Agreement
    problems: tuple[SetProblem, ...]
    solution: Solution
    wall_seconds: float

    @property
    def poses(self) -> PoseCalibration | None:
        """What poses are at the values; None without."""
        return poses_of(self.others)

    @property
    def frequency(self) -> FrequencyCalibration | None:
        """What frequency responses are at the values; None without."""
        return frequency_of(self.others)


@in_solver_context
def calibrate_with_rests(
    robot: Robot,
    rests: Sequence[Rests],
    sessions: Sequence[Poses] = (),
    shaken: Sequence[tuple[Signals, Excitation]] = (),
    progress: Progress | None = None,
) -> WithRests:
    """Calibrates a robot from rests, and from poses, frequency responses or both.

    Args:
        robot: with what each of the kinds needs.
        rests: of each recording.
        sessions: as of `calibrate_poses`.
        shaken: as of `calibrate_frequency`.
        progress: called with a text and the share done.

    Raises:
        RecordingError: rests alone.
        JointscopeError: as of `calibrate_rests`, `calibrate_poses` and `calibrate_frequency`.
    """
    began, report = time.perf_counter(), progress or (lambda text, share: None)
    others = _without_rests(robot, sessions, shaken, report)
    poses = poses_of(others)
    placed = with_knots(robot if poses is None else poses.problems[0].robot, rests)
    alone = calibrate_rests(placed, rests, lambda text, share: report(text, 0.8))
    near = _with_values_of(placed, alone.likeliest, [p.name for p in alone.parameters])
    near = _with_values_of(near, others.robot, told_by(others))
    graph = solve_all_kinds(near, alone.problems, others, sessions, report)
    likely = graph.calibration
    at, covariance, said = _posterior(placed, graph)
    sigmas = np.sqrt(np.diag(covariance)) * at.value_by_coordinate
    found = placed.with_values(at.by_name)
    found = replace(found, parameters=with_sigmas(found.parameters, dict(zip(at.names, sigmas.tolist(), strict=True))))
    if graph.poses is not None:
        found = replace(found, poses=graph.poses.robot.poses)
    peak = placed.with_values(likely.by_name)
    report("done", 1.0)
    return WithRests(
        robot=found,
        rests=_rests_at(alone, graph, said, found, peak, at, covariance),
        others=_others_at(others, graph, found, covariance),
        agreement=_agreement(alone, others),
        problems=graph.problems,
        solution=graph.solution,
        wall_seconds=time.perf_counter() - began,
    )


def _without_rests(
    robot: Robot, sessions: Sequence[Poses], shaken: Sequence[tuple[Signals, Excitation]], report: Progress
) -> StillCalibration:
    if sessions and shaken:
        return calibrate_kinds(robot, shaken, sessions, report)
    if sessions:
        return calibrate_poses(robot, sessions, report)
    if shaken:
        return calibrate_frequency(robot, shaken, report)
    raise RecordingError("rests alone: calibrate_rests(robot, rests) takes them")


def _with_values_of(robot: Robot, other: Robot, names: Sequence[str]) -> Robot:
    return robot.with_values({name: other.parameters[name].value for name in names})


def _posterior(robot: Robot, graph: AllKinds) -> tuple[Calibration, Array, SaidElsewhere]:
    """Means, covariance of their coordinates, and what the other kinds and priors say; bands integrated over.

    Raises:
        SolveError: a friction that ran away, or a band that closes at a rest.
    """
    whole, x, likely = RestSet.joined(graph.rests), np.vstack(graph.states), graph.calibration
    check_bands(whole, x, likely)
    scale = likely.value_by_coordinate
    said = SaidElsewhere.of(whole, x, likely, graph.covariance * np.outer(scale, scale))
    return *band_posterior(whole, robot, x, likely, said), said


def _rests_at(
    alone: RestCalibration,
    graph: AllKinds,
    said: SaidElsewhere,
    found: Robot,
    peak: Robot,
    at: Calibration,
    covariance: Array,
) -> RestCalibration:
    """The rests at the values of all kinds; their parameters are those of which the rests themselves say anything."""
    whole, told = RestSet.joined(graph.rests), {p.name for p in alone.parameters}
    table = dynamic_parameters(alone.start, at, np.sqrt(np.diag(covariance)))
    names = {p.name for p in alone.derived}
    asked = AskedOfRests.of(whole, alone.start, np.vstack(graph.states), graph.calibration, said)
    scale = at.value_by_coordinate
    return replace(
        alone,
        robot=found,
        likeliest=peak,
        problems=graph.rests,
        states=graph.states,
        parameters=tuple(p for p in table if p.name in told),
        derived=tuple(p for p in derived_results(alone.start, at, covariance) if p.name in names),
        covariance=covariance * np.outer(scale, scale),
        doubts=asked.doubts() if asked else (),
        unnoticed=unnoticed(asked, alone.start) if asked else (),
        errors=rest_errors([problem.of_robot(found) for problem in graph.rests]),
        iterations=alone.iterations + len(graph.solution.iterations),
        cost=graph.solution.cost,
    )


def _others_at(others: StillCalibration, graph: AllKinds, found: Robot, covariance: Array) -> StillCalibration:
    """The other kinds at the values of all."""
    poses, frequency = poses_of(others), frequency_of(others)
    if poses is not None and graph.poses is not None:
        poses = replace(
            graph.poses,
            robot=found,
            start=poses.start,
            before=poses.before,
            covariance=covariance,
            iterations=poses.iterations + graph.poses.iterations,
        )
    if frequency is not None and graph.summary is not None:
        shaken = tuple(problem.of_robot(found) for problem in frequency.problems)
        frequency = replace(frequency, robot=found, problems=shaken, covariance=covariance, summary=graph.summary)
    if isinstance(others, KindsCalibration):
        assert poses is not None and frequency is not None and graph.summary is not None
        return replace(others, robot=found, poses=poses, frequency=frequency, summary=graph.summary)
    return poses or frequency or others


def _agreement(alone: RestCalibration, others: StillCalibration) -> Agreement:
    """Rests against the others, in coordinates of unit prior variance of the values of which rests say anything."""
    base = others.poses if isinstance(others, KindsCalibration) else others
    index = [base.names.index(p.name) for p in alone.parameters]
    means, told = [], []
    at = Calibration.of(alone.robot).value_by_coordinate
    for robot, covariance in ((alone.robot, alone.covariance / np.outer(at, at)), (others.robot, base.covariance)):
        parameters = [robot.parameters[p.name] for p in alone.parameters]
        unit = np.array([p.coordinate_sigma for p in parameters])
        away = [np.log(p.value / p.prior) if p.positive else p.value - p.prior for p in parameters]
        means.append(np.array(away) / unit)
        told.append(np.linalg.inv(covariance[np.ix_(index, index)] / np.outer(unit, unit)) - np.eye(len(unit)))
    return agreement((means[0], told[0]), (means[1], told[1]))
