# SPDX-License-Identifier: BSD-3-Clause
"""Geometry and sag of an arm from poses, in one estimate: every value with its sigma, and what poses cannot tell.

The solver is that of every calibration. The size of what transmissions do unseen is found from the residuals, outliers
are left out by name, and both are repeated until nothing changes.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.poses.determined import Determined, determined
from jointscope.graphs.poses.linear_poses import LinearPoses, filled
from jointscope.graphs.poses.pose_set import TRACKER_POSE, PoseSet
from jointscope.graphs.poses.screen_poses import screen_poses
from jointscope.graphs.poses.tip_errors import TipErrors, tip_errors
from jointscope.graphs.poses.tracker_start import placed
from jointscope.graphs.poses.trimmed_poses import (
    MOST_OUT,
    OUTLYING,
    Outlier,
    as_one_target,
    squared_distances,
    with_fitted,
    without_hidden,
    without_outliers,
)
from jointscope.graphs.poses.two_noises import noise_ratios
from jointscope.graphs.poses.what_moved import what_moved
from jointscope.graphs.rest_sets.independent_states import reduced
from jointscope.graphs.solving.batch_solver import Progress, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.graphs.solving.set_problem import SetProblem
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.robots.errors import RecordingError, SolveError
from jointscope.robots.geometry.error_parameters import error_names
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import with_sigmas
from jointscope.robots.recordings.poses import Poses

Array = NDArray[np.float64]
PASSES = 12  # of repeatability and outliers
AGREES = 0.02  # relative change of the repeatability that asks for no further pass
MOST_ITERATIONS = 400  # milliseconds each; stiffnesses that an effect which is missing pulls along go a long way
TOUCHED = 0.98  # of its prior's sigma: a value whose sigma stays above it was told nothing


@dataclass(frozen=True, eq=False)
class PoseCalibration:
    """Result of a calibration from poses.

    Attributes:
        robot: with the values that were found, their sigmas and the repeatability.
        start: before.
        problems: the sessions without the poses that were left out.
        calibrations: the shared values of each session, points of contacts included.
        names: of the free parameters, shape (p,).
        covariance: of their coordinates (logarithms of positive ones), shape (p, p).
        errors: of each session at the found values.
        before: the same at the start values.
        determined: which geometric errors these poses tell apart.
        repeatability: factor on the sigmas of the joints that the robot file had.
        chi2: of the residuals per degree of freedom.
        left_out: poses, or targets of them, that fit nothing.
        iterations: of all passes.
        wall_seconds: of the whole.
        whole: the sessions with the poses that were left out.
    """

    robot: Robot
    start: Robot
    problems: tuple[PoseSet, ...]
    calibrations: tuple[Calibration, ...]
    names: tuple[str, ...]
    covariance: Array
    errors: tuple[TipErrors, ...]
    before: tuple[TipErrors, ...]
    determined: Determined
    repeatability: float
    chi2: float
    left_out: tuple[Outlier, ...]
    iterations: int
    wall_seconds: float
    whole: tuple[PoseSet, ...]

    @property
    def told(self) -> tuple[str, ...]:
        """Names of the parameters of which the poses say anything."""
        parameters = self.robot.parameters
        return tuple(n for n in self.names if (parameters[n].sigma or 0.0) < TOUCHED * parameters[n].prior_sigma)

    @property
    def count(self) -> int:
        """Number of poses that were used."""
        return sum(len(problem.poses) for problem in self.problems)


@in_solver_context
def calibrate_poses(
    robot: Robot, sessions: Sequence[Poses], progress: Progress | None = None, others: Sequence[SetProblem] = ()
) -> PoseCalibration:
    """Calibrates an arm from poses.

    Args:
        robot: with a section `poses`.
        sessions: poses with one place of the tracker each; contacts of several sessions have names of their own.
        progress: called with a text and the share done.
        others: recordings of other kinds in the same graph, without blocks of their own.

    Raises:
        RobotError: the robot has no such section.
        RecordingError: poses that cannot be those of this robot, or too few.
        SolveError: no convergence, or too many outliers.
    """
    began, report = time.perf_counter(), progress or (lambda text, share: None)
    _must_be_poses(sessions)
    report("looking at the poses", 0.0)
    robot, problems = placed(robot, sessions)
    screen_poses(problems)
    before = tuple(tip_errors(problem) for problem in problems)
    out: list[Outlier] = []
    scale, turning, weighted, iterations = 1.0, 1.0, False, 0
    known: Sequence[Calibration] = ()
    states: Sequence[Array] = ()
    for i in range(PASSES):
        problems = [replace(problem, repeatability=scale, turning=turning) for problem in problems]
        everything = [*problems, *others]
        solution = solve(everything, _estimate(everything, known, states), max_iterations=MOST_ITERATIONS)
        iterations, known = iterations + len(solution.iterations), solution.estimate.calibrations
        states = solution.estimate.states[len(problems) :]
        report(f"pass {i + 1}, cost {solution.cost:.6g}", (i + 1) / PASSES)
        if not (solution.converged or solution.flat):
            raise SolveError(
                f"no convergence after {len(solution.iterations)} iterations over {sum(map(len, sessions))} poses; "
                "units, axes or names may be wrong: look at what `jointscope compare ROBOT --poses POSES` says"
            )
        if i == 0:
            whole = (problems, known[: len(problems)])
            problems, out = without_hidden(robot, problems, known[: len(problems)])
        if i == 0 and out:
            continue
        distances = [squared_distances(p, c) for p, c in zip(problems, known, strict=False)]
        far = [d * as_one_target(p.targets.there.sum(axis=1)) for p, d in zip(problems, distances, strict=True)]
        worst = max(float(d.max()) for d in far)
        if weighted and i < PASSES - 1 and worst > OUTLYING:
            problems, found = without_outliers(problems, known[: len(problems)], far, max(OUTLYING, 0.25 * worst))
            out += found
            _must_be_few(out, problems, *whole)
            continue
        covariance = posteriors(everything, solution)[1]
        each = zip(others, states, known[len(problems) :], strict=True)
        elsewhere = [reduced(other.linearize(x, c))[0] for other, x, c in each]
        ratio = _chi2(problems, known[0], covariance, distances, elsewhere)
        own = [solution.shared.indices(k) for k in range(len(problems))]
        changes = _changes(problems, known[: len(problems)], [covariance[np.ix_(k, k)] for k in own], ratio)
        if np.all(np.abs(np.log(changes)) < AGREES):
            break
        scale, turning, weighted = float(scale * changes[0]), float(turning * changes[1]), True
    seconds = time.perf_counter() - began
    known = known[: len(problems)]
    return _result(robot, problems, known, covariance, before, ratio, out, iterations, seconds, whole[0])


def _must_be_poses(sessions: Sequence[Poses]) -> None:
    """Paths and single sessions are what is given by mistake."""
    many = not isinstance(sessions, Poses | str | Path) and len(sessions) > 0
    wrong: object = next((each for each in sessions if not isinstance(each, Poses)), None) if many else sessions
    if wrong is not None:
        raise RecordingError(
            f"expected a list of poses, got {type(wrong).__name__}; jointscope.tools.bags.at_poses.read_poses."
            "read_poses(path, robot) reads those of a table or bag: calibrate_poses(robot, [read_poses(path, robot)])"
        )


def _estimate(problems: Sequence[SetProblem], known: Sequence[Calibration], states: Sequence[Array]) -> Estimate:
    """Where to go on: at values that were found before, perhaps with other poses, or at the start values.

    Args:
        problems: poses first.
        known: values that were found.
        states: of the last problems, which did not change.
    """
    starts = [problem.start(Calibration.of(problem.robot)) for problem in problems]
    found = [start for _, start in starts]
    if known:
        pairs = zip(found, known, strict=True)
        found = [start.with_points({name: other[name] for name in start.layout}) for start, other in pairs]
    begun = [x for x, _ in starts]
    return Estimate((*begun[: len(begun) - len(states)], *states), tuple(found))


def _must_be_few(
    out: Sequence[Outlier], problems: Sequence[PoseSet], whole: Sequence[PoseSet], known: Sequence[Calibration]
) -> None:
    """No more than a fifth of the poses, and of the sightings of any target, is left out.

    Args:
        out: what was left out.
        problems: what was not.
        whole: all poses.
        known: calibrations from all poses.
    """
    poses, odd = sum(not each.target for each in out), Counter(each.target for each in out if each.target)
    for target, count in [("", 0), *odd.most_common()]:
        sightings = (s for p in problems for s in p.targets.sightings if s.name == target)
        left = sum(int(np.isfinite(s.place[:, 0]).sum()) for s in sightings)
        total = left + poses + count if target else sum(len(problem.poses) for problem in whole)
        if poses + count <= MOST_OUT * total:
            continue
        first = next(each for each in out if each.target == target)
        said = f"{poses} poses fit no arm"
        hint = "check joint angles that had not settled or were commanded, targets that were lost, names and units"
        if target:
            said = f"{target} does not fit in {count} of the {left + count} poses that show it, while other targets do"
            hint = "it is loose on the tool, or is seen badly; fix it, or leave out its rows"
        step = what_moved(LinearPoses.at(with_fitted(whole[0].robot, known), whole, known), whole, known)
        if step is not None:
            raise SolveError(f"{poses + count} poses fit no arm that is the same in all of them: {step.text}")
        raise SolveError(f"{said}, as {first.pose} of {first.path} by {first.sigmas:.0f} sigma: {hint}")


def _changes(
    problems: Sequence[PoseSet], calibrations: Sequence[Calibration], covariances: Sequence[Array], ratio: float
) -> tuple[float, float]:
    """Factors on the repeatability of the joints and on the noise of orientations that the residuals ask for."""
    setup = problems[0].robot.poses
    assert setup is not None
    by_joints, by_turns = ratio, 1.0
    if any(np.any(problem.targets.turns) for problem in problems):
        by_joints, by_turns = noise_ratios(problems, calibrations, covariances)
    return (
        float(np.sqrt(by_joints)) if setup.estimate_sigma else 1.0,
        float(np.sqrt(by_turns)) if setup.estimate_turn_sigma else 1.0,
    )


def _chi2(
    problems: Sequence[PoseSet],
    first: Calibration,
    covariance: Array,
    distances: Sequence[Array],
    elsewhere: Sequence[Array],
) -> float:
    """Squared distances per degree of freedom that the fit has left; `elsewhere` is information of other kinds."""
    rows, index = sum(problem.measured for problem in problems), first.columns[DYNAMICS]
    prior = np.array([problems[0].robot.parameters[name].coordinate_sigma for name in first.names])
    used = float(np.sum(1.0 - np.diag(covariance)[index] / prior**2)) + sum(p.own_coordinates for p in problems)
    used -= sum(float(np.sum(information * covariance[index, index])) for information in elsewhere)
    return float(sum(d.sum() for d in distances)) / max(rows - used, 1.0)


def _result(
    robot: Robot,
    problems: Sequence[PoseSet],
    calibrations: Sequence[Calibration],
    covariance: Array,
    before: tuple[TipErrors, ...],
    ratio: float,
    out: Sequence[Outlier],
    iterations: int,
    seconds: float,
    whole: Sequence[PoseSet],
) -> PoseCalibration:
    first, index = calibrations[0], calibrations[0].columns[DYNAMICS]
    own = covariance[index, index]
    sigmas = np.sqrt(np.diag(own)) * first.value_by_coordinate
    found = robot.with_values(first.by_name)
    parameters = with_sigmas(found.parameters, dict(zip(first.names, sigmas.tolist(), strict=True)))
    assert robot.poses is not None
    scale, turning = problems[0].repeatability, problems[0].turning
    setup = replace(robot.poses, tracker=calibrations[0].points.get(TRACKER_POSE.name, robot.poses.tracker))
    setup = replace(setup, joint_sigmas=setup.joint_sigmas * scale, turn_sigma=setup.turn_sigma * turning)
    found = replace(found, parameters=parameters, poses=setup)
    points = [problem.point(calibration) for problem, calibration in zip(problems, calibrations, strict=True)]
    names = (*error_names(problems[0].arm.chain.joints, setup.other_names), *_gaps(first))
    order = [n for n in names if any(n in point.by_value for point in points)]
    still = [np.zeros(problem.targets.there.shape) for problem in problems]
    columns = {n: [p.by_value.get(n, zero) for p, zero in zip(points, still, strict=True)] for n in order}
    told = determined({name: filled(each, 1) for name, each in columns.items()}, order)
    pairs = list(zip(problems, calibrations, strict=True))
    problems = [replace(p, tracker=c[TRACKER_POSE.name]) if p.own_tracker else p for p, c in pairs]
    errors = tuple(tip_errors(problem, c) for problem, c in zip(problems, calibrations, strict=True))
    return PoseCalibration(
        found, robot, tuple(problems), tuple(calibrations), first.names, own, errors, before, told, scale, ratio,
        tuple(out), iterations, seconds, tuple(whole),
    )  # fmt: skip


def _gaps(calibration: Calibration) -> list[str]:
    return [name for name in calibration.names if name.endswith(".backlash")]
